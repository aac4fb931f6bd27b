use kardan::{model, study, results::*};
fn main() {
    let name = std::env::args().nth(1).unwrap();
    let source = model::builtin(&name).unwrap().source;
    let t = std::time::Instant::now();
    match study::run(source, &Default::default(), &study::Silent) {
        Err(d) => print!("{}", kardan::diagnostics::plain(source, &d)),
        Ok(s) => {
            println!("{:?} for {} runs", t.elapsed(), s.runs.len());
            println!("{:?}\n{:?}\n{:?}", s.model.coordinates, s.model.closed_loop_poles, s.warnings);
            for l in &s.model.laws { println!("{:?}", l); }
            for r in &s.runs { println!("{} {:?} {:?} {:?} events {} {:?} {:?}", r.name, r.outcome, r.energy, r.effort, r.events.len(), r.requirements, r.notes);
              for e in r.events.iter().rev().take(24).rev() { println!("   {:.9} {}", e.time, e.what); } }
        }
    }
}
