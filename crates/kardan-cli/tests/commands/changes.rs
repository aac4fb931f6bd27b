//! Values set on the command line, a command done again when its file changes, files of an earlier run, the schema for editors.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use boon::{Compiler, Draft, Schemas};
use kardan::entries::{Entries, RawValue};
use kardan::file::syntax;
use kardan::model::BUILTIN;
use serde_json::{Map, Value};

use super::schemas::printed;

const MODEL: &str = "[parameters]\nJ = \"2 kg m^2\"\n[shaft.axle]\ninertia = \"J\"\n[motor.drive]\nshaft = \"axle\"\n\
                     [scenario]\nduration = \"0.1 s\"\noutput_step = \"10 ms\"\n[[scenario.event]]\nsignal = \"drive.tau\"\n\
                     at = \"0 s\"\nto = \"4 N m\"\n[[plot]]\nname = \"speed\"\ntitle = \"Speed\"\nsignals = [\"axle.w\"]\n";

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("changes").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    fs::write(path.join("axle.toml"), MODEL).unwrap();
    path
}

fn kardan(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kardan"))
        .current_dir(folder)
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

#[test]
fn a_value_that_is_set_is_computed_with() {
    let at = folder("set");
    // 4 N m for 0.1 s: the speed is 0.4 N m s over the inertia.
    for (more, speed) in [
        (vec![], 0.2),
        (vec!["--set", "J=4 kg m^2"], 0.1),
        (vec!["--set", "axle.inertia=1 kg m^2"], 0.4),
        (vec!["--set", "scenario.event[0].to=8 N m"], 0.4),
        (vec!["--set", "scenario.duration=200 ms", "--set", "J = \"1 kg m^2\""], 0.8),
    ] {
        let got = kardan(&at, &[vec!["run", "axle.toml", "--json"], more.clone()].concat());
        assert_eq!(got.status.code(), Some(0), "{more:?}: {got:?}");
        let last = printed(&got.stdout)["variants"][0]["signals"]["axle.w"]["final"].as_f64().unwrap();
        assert!((last - speed).abs() < 1e-9, "{more:?}: {last}");
    }
    // Every command with a model takes it; what is wrong in it is told.
    for command in ["run", "analyze", "design", "equations", "check", "bench", "linearise"] {
        let got = kardan(&at, &[command, "axle.toml", "--set", "axle.inertia=1 kg"]);
        let stderr = String::from_utf8_lossy(&got.stderr).into_owned();
        assert!(got.status.code() == Some(2) && stderr.contains("shaft.axle.inertia"), "{command}: {stderr}");
    }
    let got = kardan(&at, &["run", "axle.toml", "--set", "I=1 kg m^2", "--json"]);
    assert_eq!(printed(&got.stdout)["error"]["diagnostics"][0]["code"], "set::unknown");
}

#[test]
fn objects_of_commands_that_compute_nothing() {
    let at = folder("json");
    let check = printed(&kardan(&at, &["check", "axle.toml", "--json"]).stdout);
    assert_eq!((check["file"].as_str(), check["warnings"].as_array().map(Vec::len)), (Some("axle.toml"), Some(0)));
    let equations = printed(&kardan(&at, &["equations", "axle.toml", "--json"]).stdout);
    assert_eq!(equations["equations"][0], serde_json::json!({ "left": "2 axle''", "right": "drive.tau" }));
    assert_eq!(equations["matrices"][0]["exact"], serde_json::json!([["2"]]));
    let plan = kardan(&at, &["equations", "sia-steering", "--plan"]);
    let plan = kardan::plan::parse(&String::from_utf8(plan.stdout).unwrap()).unwrap();
    assert_eq!(plan.inputs, ["rk.phi", "fs.phi", "cj.phi", "rk.w", "fs.w", "cj.w"]);
    assert!(plan.outputs.contains(&"H[rk,rk]".to_owned()) && plan.operations() > 10, "{plan}");
    assert_eq!(kardan(&at, &["equations", "axle.toml", "--plan", "--json"]).status.code(), Some(2));
    assert_eq!(equations.get("symbolic"), None);
    let symbolic = printed(&kardan(&at, &["equations", "axle.toml", "--symbolic", "--json"]).stdout);
    assert_eq!(symbolic["symbolic"]["inertia"][0]["formula"]["text"], "J");
    assert_eq!(symbolic["symbolic"]["values"][0]["name"], "J");
    let latex = kardan(&at, &["equations", "sia-steering", "--symbolic", "--latex"]).stdout;
    assert!(String::from_utf8(latex).unwrap().contains(r"J_{\mathrm{fs}} + i_{\mathrm{hd}}^{2} \, J_{\mathrm{wg}}"));
    assert_eq!(kardan(&at, &["equations", "axle.toml", "--symbolic", "--plan"]).status.code(), Some(2));
    let models = printed(&kardan(&at, &["models", "--json"]).stdout);
    assert_eq!(models["models"].as_array().unwrap().len(), BUILTIN.len());
    let model = printed(&kardan(&at, &["models", "two-bodies", "--json"]).stdout);
    assert!(model["models"][0]["source"].as_str().unwrap().contains("[shaft.body_1]"));
    let gear = printed(&kardan(&at, &["elements", "gear", "--json"]).stdout);
    assert_eq!((gear["tables"].as_array().unwrap().len(), &gear["tables"][0]["header"]), (1, &"[gear.NAME]".into()));
    let schemas = printed(&kardan(&at, &["schema", "--json"]).stdout);
    assert!(schemas["schemas"].as_array().unwrap().len() > 10);
    let script = printed(&kardan(&at, &["completions", "bash", "--json"]).stdout);
    assert!(script["script"].as_str().unwrap().contains("rack-and-pinion"));
}

/// A shell that has read its script offers the built-in models behind a command that takes one.
#[test]
fn completions_know_the_models() {
    let at = folder("completions");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(kardan(&at, &["completions", shell]).status.success(), "{shell}");
    }
    let script = String::from_utf8(kardan(&at, &["completions", "bash"]).stdout).unwrap();
    let completion_request =
        "COMP_WORDS=(kardan run two-b); COMP_CWORD=2; _kardan kardan two-b run; printf '%s\\n' \"${COMPREPLY[@]}\"";
    let Ok(got) = Command::new("bash").args(["-c", &format!("{script}\n{completion_request}")]).output() else {
        return;
    };
    assert_eq!(String::from_utf8_lossy(&got.stdout).trim(), "two-bodies", "{got:?}");
}

#[test]
fn files_of_an_earlier_run_do_not_stand_beside_new_ones() {
    let at = folder("earlier");
    let names = |of: &str| {
        let entries =
            fs::read_dir(at.join(of)).map(|entries| entries.flatten().collect::<Vec<_>>()).unwrap_or_default();
        let mut names: Vec<String> = entries.iter().map(|entry| entry.file_name().into_string().unwrap()).collect();
        names.retain(|name| !name.starts_with('.'));
        names.sort();
        names
    };
    let run = |more: &[&str]| {
        let got = kardan(&at, &[&["run", "axle.toml"], more].concat());
        assert_eq!(got.status.code(), Some(0), "{got:?}");
        String::from_utf8_lossy(&got.stderr).into_owned()
    };
    assert_eq!(run(&[]), "");
    assert_eq!(names("kardan-out"), ["mechanism.svg", "model.csv", "report.html", "speed.svg"]);
    assert_eq!(run(&[]), "", "the same files");
    fs::write(at.join("kardan-out/mine.csv"), "mine").unwrap();
    let stderr = run(&["--set", "model.name=axle", "--set", "plot[0].name=turning"]);
    assert!(stderr.contains("model.csv") && stderr.contains("speed.svg") && stderr.contains("earlier"), "{stderr}");
    assert_eq!(names("kardan-out"), ["axle.csv", "earlier", "mechanism.svg", "mine.csv", "report.html", "turning.svg"]);
    assert_eq!(names("kardan-out/earlier"), ["model.csv", "speed.svg"]);
    // What somebody has changed since is his.
    fs::write(at.join("kardan-out/axle.csv"), "changed").unwrap();
    run(&["--no-report"]);
    assert_eq!(names("kardan-out"), ["axle.csv", "earlier", "mine.csv", "model.csv"]);
    assert_eq!(names("kardan-out/earlier"), ["mechanism.svg", "model.csv", "report.html", "speed.svg", "turning.svg"]);
}

/// The object that `check --json` prints comes again when the file is written, and a signal ends it.
#[cfg(unix)]
#[test]
fn a_file_is_watched() {
    let at = folder("watch");
    let mut child = Command::new(env!("CARGO_BIN_EXE_kardan"))
        .current_dir(&at)
        .args(["check", "axle.toml", "--watch", "--json"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (to, from) = std::sync::mpsc::channel();
    let (out, err) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
    let waiting = to.clone();
    std::thread::spawn(move || BufReader::new(out).lines().map_while(Result::ok).try_for_each(|line| to.send(line)));
    std::thread::spawn(move || {
        BufReader::new(err).lines().map_while(Result::ok).try_for_each(|line| waiting.send(line))
    });
    // An object on one stream and the word on the other, in either order.
    let both = || {
        let mut lines = Vec::new();
        while !(lines.iter().any(|line: &String| line.starts_with('{'))
            && lines.iter().any(|line| line.contains("waiting")))
        {
            match from.recv_timeout(std::time::Duration::from_secs(60)) {
                Ok(line) => lines.push(line),
                Err(_) => panic!("nothing more comes after {lines:?}"),
            }
        }
        let object = lines.iter().find(|line| line.starts_with('{')).unwrap();
        printed(object.as_bytes())
    };
    assert_eq!(both()["file"], "axle.toml");
    fs::write(at.join("axle.toml"), MODEL.replace("\"2 kg m^2\"", "\"2 kg m\"")).unwrap();
    assert_eq!(both()["error"]["diagnostics"][0]["code"], "unit::dimension");
    fs::write(at.join("axle.toml"), MODEL).unwrap();
    assert_eq!(both()["file"], "axle.toml");
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    for (arguments, word) in
        [(["check", "two-bodies", "--watch"], "does not change"), (["check", "-", "--watch"], "read once")]
    {
        let got = kardan(&at, &arguments);
        let stderr = String::from_utf8_lossy(&got.stderr).into_owned();
        assert!(got.status.code() == Some(2) && stderr.contains(word), "{stderr}");
    }
}

/// A model file as the value that a schema is about.
fn value(entries: &Entries) -> Value {
    let of = |raw: &RawValue| match raw {
        RawValue::Text(text) => Value::String(text.clone()),
        RawValue::Number(number) => serde_json::from_str(number).unwrap_or(Value::String(number.clone())),
        RawValue::List(list) => Value::Array(list.iter().map(|entry| one(&entry.value)).collect()),
        RawValue::Table(table) => value(table),
        other => panic!("{other:?}"),
    };
    Value::Object(entries.iter().map(|entry| (entry.key.clone(), of(&entry.entry.value))).collect::<Map<_, _>>())
}

fn one(raw: &RawValue) -> Value {
    let mut entries = Entries::default();
    entries.set("value", raw.clone());
    value(&entries)["value"].clone()
}

#[test]
fn the_schema_for_editors_takes_models_and_marks_errors() {
    let at = folder("schema");
    let text = kardan(&at, &["schema", "model"]).stdout;
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/kardan.schema.json");
    assert!(
        fs::read(&beside).is_ok_and(|file| file == text),
        "models/kardan.schema.json is stale: kardan schema model > models/kardan.schema.json"
    );
    let schema: Value = serde_json::from_slice(&text).unwrap();
    let (mut schemas, mut compiler) = (Schemas::new(), Compiler::new());
    compiler.set_default_draft(Draft::V7);
    compiler.add_resource("http://localhost/model.json", schema).unwrap();
    let index = compiler.compile("http://localhost/model.json", &mut schemas).unwrap_or_else(|why| panic!("{why:#}"));
    let wrong = |text: &str| {
        let (entries, diagnostics) = syntax(text);
        assert_eq!(diagnostics, [], "{text}");
        schemas.validate(&value(&entries), index).err().map(|why| format!("{why:#}"))
    };
    for builtin in BUILTIN {
        assert!(builtin.source.starts_with("#:schema kardan.schema.json\n"), "{}", builtin.name);
        assert_eq!(wrong(builtin.source), None, "{}", builtin.name);
    }
    for kind in kardan::element::REGISTRY {
        assert_eq!(wrong(kind.example), None, "{}", kind.keyword);
    }
    for law in kardan::synthesis::REGISTRY {
        assert_eq!(wrong(law.example), None, "{}", law.keyword);
    }
    assert_eq!(wrong(MODEL), None);
    for (good, bad) in [
        ("inertia = \"J\"", "inertai = \"J\""),
        ("inertia = \"J\"", "inertia = 2"),
        ("inertia = \"J\"", "inertia = \"2\""),
        ("shaft = \"axle\"", ""),
        ("shaft = \"axle\"", "shaft = [\"axle\"]"),
        ("[motor.drive]", "[moter.drive]"),
        ("[motor.drive]", "[motor.\"the drive\"]"),
        ("duration = \"0.1 s\"", "duration = 0.1"),
        ("signal = \"drive.tau\"", "signals = \"drive.tau\""),
        ("title = \"Speed\"", ""),
    ] {
        assert!(MODEL.contains(good));
        assert!(wrong(&MODEL.replace(good, bad)).is_some(), "{bad} is taken");
    }
    let law = "[control.c]\nlaw = \"lqr\"\n";
    assert!(wrong(&format!("{MODEL}{}", law.replace("lqr", "lqg"))).is_some());
    // A model that is saved has its schema beside it.
    assert!(kardan(&at, &["models", "two-bodies", "--write", "mine.toml"]).status.success());
    assert_eq!(fs::read(at.join("kardan.schema.json")).unwrap(), text);
}
