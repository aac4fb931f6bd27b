//! How `kardan check` grows with the entries of a model: `cargo bench -p kardan --bench grown`. Of each kind the time of 10, 100, 1000 and
//! 10,000 entries, the power of their number by which it grows from one to the next, and the most memory at once (MB) with the last number of
//! entries. It fails where 10,000 take more than a second or 200 MB, or the power is above 1.2.
//! `cargo bench -p kardan --bench grown -- chain` takes the kinds with that word in their name;
//! `cargo bench -p kardan --bench grown -- write DIR COUNT` writes the models with so many entries, for `tests/deep.py`.

#[path = "../tests/common/grown.rs"]
mod grown;

use std::hint::black_box;
use std::time::Instant;

use grown::{CHAINS, CIRCLES, COUPLED, Kind, NESTED, REFUSED, WIDE};
use kardan::study;

/// A kind that took so long (s) is not asked for more entries.
const LONG: f64 = 20.0;
/// What 10,000 entries may take at most: s, MB, and the power of their number from 1000 on.
const LIMITS: [f64; 3] = [1.0, 200.0, 1.2];

/// The shortest time of some checks of a model, s.
fn shortest(source: &str) -> f64 {
    let mut least = f64::INFINITY;
    let start = Instant::now();
    while least.is_infinite() || start.elapsed().as_secs_f64() < 0.1 {
        let begin = Instant::now();
        black_box(study::check(black_box(source)));
        least = least.min(begin.elapsed().as_secs_f64());
    }
    least
}

/// Prints the times of one kind with up to so many entries; whether 10,000 stay below the limits.
fn measure((name, model): &Kind, most: usize) -> bool {
    print!("{name:40}");
    let (mut before, mut memory, mut power) = (None::<f64>, 0, 0.0);
    for count in [10, 100, 1000, 10_000].into_iter().filter(|count| *count <= most) {
        let source = model(count);
        let time = shortest(&source);
        match before {
            Some(before) => {
                power = (time / before).log10();
                print!("{:>11.2} ms (n^{power:.2})", 1e3 * time);
            }
            None => print!("{:>9.2} ms", 1e3 * time),
        }
        before = Some(time);
        memory = allocation_counter::measure(|| drop(black_box(study::check(&source)))).bytes_max;
        if time > LONG {
            break;
        }
    }
    let reached = [before.unwrap_or_default(), memory as f64 / 1e6, power];
    let within = most < 10_000 || (0..3).all(|k| reached[k] <= LIMITS[k]);
    println!("{:>8.0} MB{}", reached[1], if within { "" } else { "  ABOVE THE LIMIT" });
    within
}

/// Writes the model of each kind with so many entries into a folder.
fn write(folder: &str, count: usize) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for (name, model) in [WIDE, CHAINS, CIRCLES, REFUSED, COUPLED, NESTED].into_iter().flatten() {
        std::fs::write(format!("{folder}/{}.toml", name.replace(' ', "-")), model(count))?;
    }
    Ok(())
}

fn main() {
    let own: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    if let [mode, folder, count] = &own[..]
        && mode == "write"
    {
        write(folder, count.parse().expect("a count")).expect("a folder to write into");
        return;
    }
    let word = std::env::args().skip(1).find(|word| !word.starts_with('-')).unwrap_or_default();
    let all = [("wide", WIDE), ("chains", CHAINS), ("circles", CIRCLES), ("refused", REFUSED), ("coupled", COUPLED)];
    let mut above = 0;
    for (title, kinds) in all {
        // The matrices of coupled bodies grow with the square of their number.
        let most = if title == "coupled" { 1000 } else { 10_000 };
        println!("{title}: 10 to {most} entries");
        above += kinds.iter().filter(|(name, _)| name.contains(&word)).filter(|kind| !measure(kind, most)).count();
    }
    if above > 0 {
        println!("{above} kinds are above the limits of 10,000 entries: 1 s, 200 MB, n^1.2");
        std::process::exit(1);
    }
}
