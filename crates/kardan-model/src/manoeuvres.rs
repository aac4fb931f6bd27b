//! `[manoeuvre.NAME]` and `[path.NAME]`: they become signals, tables, figures, requirements and values of variants before reading.

use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};

use super::document::Document;
use super::examples::example_of;
use super::parameters::{REMOVE_TOLERANCE, refuse_tolerances};
use super::parse::{Node, table};
use kardan_elements::manoeuvre::{self, COMMON, Cones, Made, Manoeuvre, ManoeuvreKind, ManoeuvreSpec, Need, Path};
use kardan_math::names::unknown_name;
use kardan_math::units::parse_number;
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, quoted, shortened};
use kardan_schema::entries::{Entries, Entry, KeyedEntry, Place, RawValue};
use kardan_schema::schema::{EntryValue, Keys, Names, Table};

/// The parameter that is the length of a run.
const DURATION: &str = "run_duration";
/// The parameter that is the number of the manoeuvre, zero for none.
const NUMBER: &str = "manoeuvre";

/// Replaces a key of that name, with all its content at a place.
fn put(table: &mut Entries, key: &str, value: RawValue, place: &Place) {
    table.remove(key);
    table.push(KeyedEntry::at(key, &value, place));
}

/// The first name of a kind of element.
fn first(entries: &Entries, keyword: &str) -> Option<String> {
    Some(entries.entries_of(keyword).next()?.key.clone())
}

/// A manoeuvre with its generated entries.
struct Driven<'a> {
    name: &'a str,
    /// From one on.
    number: usize,
    place: &'a Place,
    keys: &'a Entries,
    made: Made,
    /// Names of the variants that drive it.
    variants: Vec<String>,
}

impl Driven<'_> {
    /// The signal that it makes.
    fn steering_signal(&self) -> String {
        let other = if self.made.path.is_some() { "lane" } else { "steer" };
        self.keys.text("steering_signal").unwrap_or(other).to_string()
    }

    /// An expression that is one where it is driven, else zero.
    fn switch(&self) -> String {
        format!("if({NUMBER} == {}, 1, 0)", self.number)
    }

    fn is_steered(&self) -> bool {
        self.made.angle.is_some() || self.made.path.is_some()
    }
}

/// The readable manoeuvres, each with its generated entries.
fn driven(entries: &Entries) -> Vec<Driven<'_>> {
    let (car, driver) = (first(entries, "vehicle"), first(entries, "driver"));
    let wheel = entries.tables_of("driver").find_map(|(_, table)| table.text("wheel").map(str::to_string));
    let mut out = Vec::new();
    for (found, keys) in entries.tables_of("manoeuvre") {
        let Some(kind) = keys.text("kind").and_then(manoeuvre::find) else { continue };
        let missing = |(key, need): &(&str, Need)| *need == Need::Required && keys.get(key).is_none();
        if kind.keys.iter().any(missing) {
            continue;
        }
        let own = |key: &str| keys.text(key).map(str::to_string);
        let hands = driver.as_ref().map(|driver| manoeuvre::quoted(&format!("{driver}_hands.tau")));
        let spec = ManoeuvreSpec {
            name: &found.key,
            kind,
            keys,
            car: own("car").or_else(|| car.clone()),
            wheel: own("wheel").or_else(|| wheel.clone()),
            torque: own("torque").or(hands),
        };
        let mut made = Made::default();
        (kind.write)(&spec, &mut made);
        if keys.text("evaluate") == Some("no") || spec.car.is_none() {
            made.figures.clear();
            made.requirements.clear();
        }
        let number = out.len() + 1;
        out.push(Driven { name: &found.key, number, place: &found.place, keys, made, variants: Vec::new() });
    }
    out
}

/// The entries with those that manoeuvres and paths generate added.
pub(super) fn with_manoeuvres(entries: &Entries) -> Cow<'_, Entries> {
    let mut all = driven(entries);
    if entries.table("path").is_none() && all.is_empty() {
        return Cow::Borrowed(entries);
    }
    let mut out = entries.clone();
    paths(entries, &mut out);
    if all.is_empty() {
        return Cow::Owned(out);
    }
    variants(&mut all, &mut out);
    for one in &all {
        for (group, name, table) in &one.made.tables {
            out.table_mut(group).push(KeyedEntry::at(name, &RawValue::Table(table.clone()), one.place));
        }
        let names = Names(one.variants.clone()).raw();
        for (key, tables) in [("figure", &one.made.figures), ("requirement", &one.made.requirements)] {
            for table in tables.iter().filter(|_| !one.variants.is_empty()) {
                let mut table = table.clone();
                table.set("variants", names.clone());
                out.list_mut(key).push(KeyedEntry::at("", &RawValue::Table(table), one.place).entry);
            }
        }
    }
    steer(&all, &mut out);
    shared(&all, &mut out);
    Cow::Owned(out)
}

/// The cones that cars must pass.
pub(super) fn cones(entries: &Entries) -> Vec<Cones> {
    driven(entries).into_iter().filter_map(|one| one.made.cones).collect()
}

/// The names of the tables that manoeuvres and paths generate.
pub(super) fn lanes(entries: &Entries) -> BTreeSet<String> {
    let mut made = Entries::default();
    paths(entries, &mut made);
    let of_paths = made.entries_of("table").map(|found| found.key.clone());
    let of_manoeuvres = driven(entries).into_iter().flat_map(|one| one.made.tables);
    of_manoeuvres.filter(|(group, ..)| *group == "table").map(|(_, name, _)| name).chain(of_paths).collect()
}

/// `[path.NAME]` as tables.
fn paths(entries: &Entries, out: &mut Entries) {
    for (found, keys) in entries.tables_of("path") {
        let (Some(kind), Some(width)) = (keys.text("kind"), keys.text("width")) else { continue };
        let value = |key: &str| keys.text(key).map(|text| format!("({text})"));
        let start = value("start").unwrap_or("0 m".into());
        let side = keys.text("side").unwrap_or("left");
        let lanes = manoeuvre::lanes(kind, &format!("({width})"), value("offset").as_deref(), &start, side);
        for (part, table) in lanes {
            let name = format!("{}{part}", found.key);
            out.table_mut("table").push(KeyedEntry::at(&name, &RawValue::Table(table), &found.place));
        }
    }
}

/// Adds to variants the settings of their manoeuvres; without variants each manoeuvre is one.
fn variants(all: &mut [Driven<'_>], out: &mut Entries) {
    if out.get("variant").is_none() {
        for one in all.iter() {
            let keys = Entries::of_texts([("name", one.name), ("manoeuvre", one.name)]);
            out.list_mut("variant").push(KeyedEntry::at("", &RawValue::Table(keys), one.place).entry);
        }
    }
    let usual = out.table("scenario").and_then(|scenario| scenario.get("duration")).cloned();
    let place = all[0].place.clone();
    let parameter = |out: &mut Entries, name: &str, value: RawValue, place: &Place| {
        let parameters = out.table_mut("parameters");
        if parameters.get(name).is_none() {
            parameters.push(KeyedEntry::at(name, &value, place));
        }
    };
    parameter(out, DURATION, usual.unwrap_or(RawValue::Text("1 s".into())), &place);
    let steered = all.iter().any(Driven::is_steered);
    if steered {
        parameter(out, NUMBER, RawValue::Number("0".into()), &place);
    }
    put(out.table_mut("scenario"), "duration", RawValue::Text(DURATION.into()), &place);
    for variant in out.list_mut("variant") {
        let RawValue::Table(table) = &mut variant.value else { continue };
        let named = table.text("manoeuvre").map(str::to_string);
        let Some(one) = named.and_then(|name| all.iter_mut().find(|one| one.name == name)) else { continue };
        one.variants.extend(table.text("name").map(str::to_string));
        let mut set = one.keys.table("set").cloned().unwrap_or_default();
        if steered {
            put(&mut set, NUMBER, RawValue::Number(one.number.to_string()), one.place);
        }
        let duration = one.made.duration.clone().unwrap_or_default();
        put(&mut set, DURATION, RawValue::Text(duration), one.place);
        let own = table.table("set").cloned().unwrap_or_default();
        for entry in own.iter() {
            set.remove(&entry.key);
            set.push(entry.clone());
        }
        let place = table.keyed("set").map_or(&variant.place, |set| &set.place).clone();
        table.remove("set");
        table.push(KeyedEntry {
            key: "set".into(),
            place: place.clone(),
            entry: Entry { value: RawValue::Table(set), place },
        });
    }
}

/// A signal of the kind `expression`.
fn expression_signal(name: &str, value: String, place: &Place) -> KeyedEntry {
    let signal = Entries::of_texts([("kind", "expression".to_string()), ("value", value)]);
    KeyedEntry::at(name, &RawValue::Table(signal), place)
}

/// Inputs of manoeuvres to the car itself: zero while another one is driven.
fn shared(all: &[Driven<'_>], out: &mut Entries) {
    let mut names: Vec<&str> = all.iter().flat_map(|one| &one.made.shared).map(|(name, _)| name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    for name in names {
        let own = all.iter().flat_map(|one| one.made.shared.iter().map(move |shared| (one, shared)));
        let own: Vec<_> = own.filter(|(_, (shared, _))| shared == name).collect();
        let parts = own.iter().map(|(one, (_, part))| format!("{} * {part}", one.switch()));
        let value = parts.collect::<Vec<_>>().join(" + ");
        let Some((one, _)) = own.first() else { continue };
        out.table_mut("signal").push(expression_signal(name, value, one.place));
    }
}

/// The signals that manoeuvres share, and the paths that drivers follow.
fn steer(all: &[Driven<'_>], out: &mut Entries) {
    let mut names: Vec<String> = all.iter().map(Driven::steering_signal).collect();
    names.sort();
    names.dedup();
    for name in names {
        let own = || all.iter().filter(|one| one.steering_signal() == name);
        let switched = |expression: &str, one: &Driven<'_>| format!("{} * ({expression})", one.switch());
        let angles: Vec<String> = own().filter_map(|one| Some(switched(one.made.angle.as_deref()?, one))).collect();
        if let (false, Some(first)) = (angles.is_empty(), own().find(|one| one.made.angle.is_some())) {
            out.table_mut("signal").push(expression_signal(&name, angles.join(" + "), first.place));
        }
        let paths: Vec<String> = own().filter_map(|one| Some(switched(one.made.path.as_deref()?, one))).collect();
        if paths.is_empty() {
            continue;
        }
        let on: Vec<String> = own().filter(|one| one.made.path.is_some()).map(|one| one.switch()).collect();
        let drivers: Vec<String> = out.entries_of("driver").map(|found| found.key.clone()).collect();
        for driver in drivers {
            let driver = out.table_mut("driver").table_mut(&driver);
            let (Some(path), Some(gain)) = (driver.keyed("path").cloned(), driver.keyed("gain").cloned()) else {
                continue;
            };
            if path.entry.value.as_text() != Some(name.as_str()) {
                continue;
            }
            let (RawValue::Text(factor) | RawValue::Number(factor)) = &gain.entry.value else { continue };
            let factor = format!("({factor}) * ({})", on.join(" + "));
            put(driver, "path", RawValue::Text(paths.join(" + ")), &path.entry.place);
            put(driver, "gain", RawValue::Text(factor), &gain.entry.place);
        }
    }
}

/// Reads the keys of manoeuvres and paths, and their uses in variants; reports errors. Returns the names of those with errors.
pub(super) fn check_manoeuvres(
    [manoeuvres, paths]: [&[Node<'_>]; 2],
    variants: &[Table],
    document: &Document,
    out: &mut Vec<Diagnostic>,
) -> BTreeSet<String> {
    let mut wrong = BTreeSet::new();
    for node in manoeuvres {
        let (what, before) = (format!("manoeuvre `{}`", shortened(node.name)), out.len());
        if let Some(kind) = kind_of(node, &what, out) {
            let mut read = table(Manoeuvre::FIELDS, &node.clone().like(example_of("manoeuvre")), &what, out);
            refuse_tolerances(&mut read, &what, REMOVE_TOLERANCE, out);
            check_keys(node, kind, &what, out);
            check_periods(node, &what, out);
            check_car(node, document, &what, out);
            check_brakes(node, document, &what, out);
        }
        wrong.extend((out.len() > before).then(|| node.name.to_string()));
    }
    for node in paths {
        let (what, before) = (format!("path `{}`", shortened(node.name)), out.len());
        let mut read = table(Path::FIELDS, &node.clone().like(example_of("path")), &what, out);
        refuse_tolerances(&mut read, &what, REMOVE_TOLERANCE, out);
        wrong.extend((out.len() > before).then(|| node.name.to_string()));
    }
    for variant in variants {
        let Some((name, place)) = variant.placed_word("manoeuvre") else { continue };
        if manoeuvres.iter().any(|node| node.name == name) {
            continue;
        }
        let whose = match variant.word("name") {
            Some(name) => format!("variant `{}`", shortened(name)),
            None => "`[[variant]]`".to_string(),
        };
        let help = match manoeuvres {
            [] => "the model has no `[manoeuvre.NAME]`".to_string(),
            all => unknown_name(name, all.iter().map(|node| node.name)),
        };
        out.push(Diagnostic::no_such(&whose, "manoeuvre", name, place).help(help));
    }
    wrong
}

/// The kind of a manoeuvre; the reader reports an unknown one.
fn kind_of(node: &Node<'_>, what: &str, out: &mut Vec<Diagnostic>) -> Option<&'static ManoeuvreKind> {
    let word = node.table.text("kind").unwrap_or_default();
    let found = manoeuvre::find(word);
    if found.is_none() {
        // Reports an error in `kind`.
        let keys: Entries = node.table.keyed("kind").cloned().into_iter().collect();
        drop(table(Manoeuvre::FIELDS, &Node { table: &keys, ..node.clone() }, what, out));
    }
    found
}

/// Reports missing keys of a kind, and keys that it does not accept.
fn check_keys(node: &Node<'_>, kind: &'static ManoeuvreKind, what: &str, out: &mut Vec<Diagnostic>) {
    let field = |key: &str| Manoeuvre::FIELDS.iter().find(|field| field.name == key);
    for (key, _) in kind.keys.iter().filter(|(key, need)| *need == Need::Required && node.table.get(key).is_none()) {
        let about = field(key).map_or("", |field| field.doc);
        let message = format!("{what}: a `{}` needs the key `{key}`", kind.keyword);
        let diagnostic = Diagnostic::error("key::missing", message).at(&node.place, format!("`{key}` is missing"));
        out.push(diagnostic.help(format!("add `{key} = ...`: {about}")));
    }
    for found in node.table.iter() {
        let key = found.key.as_str();
        let takes = COMMON.contains(&key) || kind.keys.iter().any(|(own, _)| *own == key);
        if takes || field(key).is_none() {
            continue;
        }
        let own = quoted(kind.keys.iter().map(|(key, _)| *key));
        let message = format!("{what}: `{key}` has no effect on a `{}`", kind.keyword);
        let diagnostic = Diagnostic::error("manoeuvre::key", message).at(&found.place, "not used");
        out.push(diagnostic.help(format!("remove it; beside the common keys it accepts {own}")));
    }
}

/// Rejects a fractional number of periods: measures are means over whole periods, and a fraction has crossings in one direction only.
fn check_periods(node: &Node<'_>, what: &str, out: &mut Vec<Diagnostic>) {
    let Some(found) = node.table.keyed("periods") else { return };
    let (RawValue::Text(text) | RawValue::Number(text)) = &found.entry.value else { return };
    let Some(periods) = parse_number(text).ok().map(|x| x.to_f64()).filter(|x| x.fract() != 0.0) else { return };
    let message = format!(
        "{what}: `periods` is {periods}, not a whole number of periods: gradients, hystereses and gains are means over whole periods"
    );
    let diagnostic = Diagnostic::error("manoeuvre::periods", message).at(&found.entry.place, "not a whole number");
    out.push(diagnostic.help(format!("write a whole number: `periods = {}`", periods.ceil().max(1.0))));
}

/// Reports a manoeuvre without a car.
fn check_car(node: &Node<'_>, document: &Document, what: &str, out: &mut Vec<Diagnostic>) {
    let cars = || document.elements.iter().filter(|one| one.kind.keyword == "vehicle").map(|one| one.name.as_str());
    let free = node.table.text("kind") == Some("free");
    match node.table.text("car") {
        Some(name) if !cars().any(|car| car == name) && !document.suppressed.has(name) => {
            let place = node.table.keyed("car").map_or(&node.place, |car| &car.entry.place);
            let help = if cars().next().is_none() {
                "the model has no `[vehicle.NAME]`".to_string()
            } else {
                unknown_name(name, cars())
            };
            out.push(Diagnostic::no_such(what, "car", name, place).help(help));
        }
        None if cars().next().is_none() && !free && !document.suppressed.all => {
            let message = format!("{what}: the model has no car");
            let diagnostic = Diagnostic::error("manoeuvre::vehicle", message).at(&node.name_place, "no car");
            out.push(diagnostic.help("add a `[vehicle.NAME]`, or use a manoeuvre of the kind `free`"));
        }
        None if cars().nth(1).is_some() && !free => {
            let message = format!("{what}: it does not name one of the cars {}", quoted(cars()));
            let diagnostic = Diagnostic::error("manoeuvre::vehicle", message).at(&node.name_place, "`car` is missing");
            out.push(diagnostic.help("name it: `car = \"NAME\"`"));
        }
        _ => {}
    }
}

/// Reports a manoeuvre that brakes a car without brakes.
fn check_brakes(node: &Node<'_>, document: &Document, what: &str, out: &mut Vec<Diagnostic>) {
    if node.table.text("kind") != Some("split_braking") {
        return;
    }
    let named = node.table.text("car");
    let mut cars = document.elements.iter().filter(|one| one.kind.keyword == "vehicle");
    let car = cars.find(|car| named.is_none_or(|name| name == car.name));
    let Some(car) = car.filter(|car| !car.table.values.contains_key("braking")) else { return };
    if document.suppressed.has(&car.name) {
        return;
    }
    let message = format!("{what}: the car `{}` does not brake", shortened(&car.name));
    let [brakes, slows] = [("braking_signal", "braking"), ("speed_reduction_signal", "slowed")]
        .map(|(key, usual)| node.table.text(key).unwrap_or(usual));
    let help =
        format!("give it `braking = \"{brakes}\"` and `speed = \"... - {slows}\"`, with the speed it has before");
    out.push(Diagnostic::error("manoeuvre::braking", message).at(&node.name_place, "needs braking").help(help));
}

/// Reports drivers whose path does not exist.
pub(super) fn check_drivers(document: &mut Document, out: &mut Vec<Diagnostic>) {
    let mut wrong = Vec::new();
    for driver in document.elements.iter().filter(|one| one.kind.keyword == "driver") {
        let Some((path, place)) = driver.table.placed_word("path") else { continue };
        let is_name = path.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-'));
        let names = || document.tables.iter().map(|(name, _)| name.as_str());
        if !is_name || names().any(|name| name == path) || document.suppressed.has(path) {
            continue;
        }
        let what = format!("driver `{}`", shortened(&driver.name));
        let message = format!("{what}: there is no path and no table `{}`", shortened(path));
        let help = match names().next() {
            None => "add `[path.NAME]`, or a manoeuvre with lanes, and name what it steers".to_string(),
            Some(_) => unknown_name(path, names()),
        };
        out.push(Diagnostic::error("name::unknown", message).at(place, "no such path").help(help));
        wrong.push(driver.place.clone());
    }
    // Its measured signal is the same error.
    let dropped = document.blocks.iter().filter(|block| wrong.contains(&block.place));
    document.suppressed.names.extend(dropped.map(|block| block.name.clone()));
    document.blocks.retain(|block| !wrong.contains(&block.place));
}

/// Warns of manoeuvres whose signal is unused: their runs would have no input. `names` are those within a value.
pub(super) fn unfollowed_manoeuvres(
    entries: &Entries,
    document: &Document,
    names: impl Fn(&RawValue, &mut BTreeSet<String>),
    out: &mut Vec<Diagnostic>,
) {
    const FOLLOW_NOTHING: [&str; 12] = [
        "manoeuvre",
        "path",
        "variant",
        "parameters",
        "figure",
        "requirement",
        "plot",
        "safety",
        "sweep",
        "fault",
        "signal",
        "block",
    ];
    let driven = driven(entries);
    if driven.is_empty() {
        return;
    }
    let mut followed = BTreeSet::new();
    for found in entries.iter().filter(|found| !FOLLOW_NOTHING.contains(&found.key.as_str())) {
        names(&found.entry.value, &mut followed);
    }
    // Signals and blocks pass on their inputs if they are used themselves.
    let mut between: HashMap<&str, Vec<&RawValue>> = HashMap::new();
    for found in ["signal", "block"].into_iter().flat_map(|key| entries.entries_of(key)) {
        between.entry(&found.key).or_default().push(&found.entry.value);
    }
    let mut open: Vec<String> = followed.iter().cloned().collect();
    while let Some(name) = open.pop() {
        let used = [SignalName::new(&name).element, &name].map(|key| between.remove(key).unwrap_or_default());
        let mut own = BTreeSet::new();
        used.iter().flatten().for_each(|value| names(value, &mut own));
        open.extend(own.into_iter().filter(|name| followed.insert(name.clone())));
    }
    for one in driven.iter().filter(|one| one.is_steered() && !document.suppressed.has(one.name)) {
        let what = format!("manoeuvre `{}`", shortened(one.name));
        let unread = |(name, _): &&(String, String)| !followed.contains(name);
        for (name, _) in one.made.shared.iter().filter(unread) {
            let message = format!("{what}: the model does not use its signal `{name}`");
            let help = "let the car read both: `braking = \"braking\"`, and `speed = \"... - slowed\"` with the speed it has before";
            out.push(Diagnostic::warning("manoeuvre::unused-signal", message).at(one.place, "not used").help(help));
        }
        let name = one.steering_signal();
        // A braking driver may release the wheel.
        if followed.contains(&name) || (!one.made.shared.is_empty() && one.made.path.is_none()) {
            continue;
        }
        let (made, key) = if one.made.path.is_some() { ("path", "path") } else { ("signal", "angle") };
        let message = format!("{what}: the model does not use its {made} `{name}`, so no run of it has steering");
        let drivers = entries.entries_of("driver").map(|found| found.key.as_str());
        let help = match drivers.collect::<Vec<_>>().as_slice() {
            [] => format!(
                "add a `[driver.NAME]` with `{key} = \"{name}\"`, or let a torque, a reference or a position read `{name}`"
            ),
            [driver, ..] => {
                format!(
                    "write `{key} = \"{name}\"` in `[driver.{driver}]`, or name in `steering_signal` the signal that it follows"
                )
            }
        };
        out.push(Diagnostic::warning("manoeuvre::unused-signal", message).at(one.place, "not used").help(help));
    }
}

/// Removes entries generated by manoeuvres and paths with errors, and messages on them: it is the same error.
pub(super) fn leave_made_out(
    nodes: &[Node<'_>],
    wrong: &BTreeSet<String>,
    document: &mut Document,
    mut lists: [&mut Vec<Diagnostic>; 2],
) {
    for node in nodes.iter().filter(|node| wrong.contains(node.name)) {
        let own = ["manoeuvre", "path"].map(|kind| format!("{kind} `{}`", shortened(node.name)));
        let here = |place: &Place| *place == node.name_place || *place == node.place;
        for out in &mut lists {
            out.retain(|diagnostic| {
                let elsewhere = diagnostic.labels.first().is_none_or(|label| !here(&label.place));
                elsewhere || own.iter().any(|own| diagnostic.message.contains(own))
            });
        }
        let steering = node.table.text("steering_signal").into_iter().chain(["steer", "lane"]);
        let brakes = node.table.text("kind") == Some("split_braking");
        let of_car = ["braking_signal", "speed_reduction_signal"]
            .into_iter()
            .filter_map(|key| node.table.text(key))
            .chain(["braking", "slowed"]);
        let names = steering.chain(of_car.filter(|_| brakes)).map(str::to_string);
        let names: Vec<String> = names.chain([node.name.to_string()]).collect();
        document.signals.retain(|signal| !here(&signal.place) && !names.contains(&signal.name));
        document.tables.retain(|(_, table)| !here(&table.place));
        document.figures.retain(|table| !here(&table.place));
        document.requirements.retain(|table| !here(&table.place));
        document.suppressed.names.extend(names);
    }
}
