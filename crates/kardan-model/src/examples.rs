//! Examples of the tables that are neither an element nor a law: for the manual, and for the hints where a key is missing.

const MODEL: &str = "\
[model]
name = \"axle\"
description = \"A motor drives an arm through an elastic axle.\"
coordinates = [\"motor\", \"arm\"]
";

const SCENARIO: &str = "\
[scenario]
duration = \"2 s\"
initial = { \"rk.phi\" = \"10 deg\" }

[[scenario.event]]
at = \"0.1 s\"
signal = \"wg_motor.tau\"
to = \"1.3 N m\"

[[scenario.fault]]
sensor = \"wg_encoder\"
at = \"0.5 s\"
";

const EVENT: &str = "\
[[scenario.event]]
at = \"0.1 s\"
signal = \"wg_motor.tau\"
to = \"1.3 N m\"
over = \"50 ms\"
";

const FAULT: &str = "\
[[scenario.fault]]
sensor = \"wg_encoder\"
at = \"0.5 s\"
until = \"0.6 s\"

[[scenario.fault]]
motor = \"wg_motor\"
kind = \"reduced\"
value = 0.5
at = \"1 s\"
";

const SAFETY: &str = "\
[fault.encoder_lost]
sensor = \"wg_encoder\"
at = \"0.5 s\"

[fault.bar_broken]
element = \"torsion_bar\"
at = \"0.5 s\"

[safety]
pairs = \"yes\"
values = { step = [\"0.2 rad\", \"0.4 rad\"] }
detected = \"mode > 0\"
reaction = \"mode\"
detection_time_limit = \"20 ms\"

[[safety.effect]]
name = \"rack angle\"
signal = \"rk.phi\"
window = \"100 ms\"
below = \"0.5 deg\"
";

const SWEEP: &str = "\
[sweep]
samples = 500

[[sweep.vary]]
parameter = \"step\"
from = \"0.1 rad\"
to = \"0.4 rad\"
";

const REQUIREMENT: &str = "\
[[requirement]]
signal = \"wg_motor.tau\"
measure = \"max_abs\"
below = \"1.3 N m\"
";

const FIGURE: &str = "\
[[figure]]
name = \"peak\"
signal = \"rk.phi\"
measure = \"max\"
display_unit = \"deg\"

[[figure]]
name = \"peak_time\"
signal = \"rk.phi\"
measure = \"time_of_max\"

[[figure]]
name = \"product\"
value = \"peak_time * peak\"

[[requirement]]
figure = \"product\"
below = \"0.1 rad s\"
";

const MANOEUVRE: &str = "\
[parameters]
pace = \"20 m/s\"

[manoeuvre.turn]
kind = \"free\"
steering_angle = \"30 deg * sin(2 pi t / 5 s)\"
duration = \"pace * 10 s / (20 m/s)\"
set = { pace = \"100 km/h\" }

[[variant]]
name = \"fast\"
manoeuvre = \"turn\"
";

const PATH: &str = "\
[path.lane]
kind = \"iso_3888_1\"
width = \"1.8 m\"
start = \"30 m\"
";

const PLOT: &str = "\
[[plot]]
name = \"rack-angle\"
title = \"Angle of the rack\"
signals = [\"rk.phi\"]
references = [\"ref_rk\"]
display_unit = \"deg\"
";

const VARIANT: &str = "\
[parameters]
step = \"1 rad\"

[[variant]]
name = \"small-step\"
set = { step = \"0.1 rad\" }

[[scenario.event]]
at = \"0 s\"
signal = \"ref_rk\"
to = \"step\"
";

const BENCH: &str = "\
[bench]
plan = \"constant_speeds\"
speed_limit = { wg = \"120 rad/s\", cs = \"6 rad/s\" }
least_speed = { cs = \"0.5 rad/s\" }
points = 24
torque_noise = \"0.01 N m\"

[bench.truth]
\"wg.damping\" = \"0.001 N m s/rad\"
\"hd.stiffness\" = \"8000 N m/rad\"
";

const ANALYSIS: &str = "\
[analysis]
inputs = [\"wg_motor\", \"rk_motor\"]
outputs = [\"rk.phi\", \"fs.phi\"]
at = { \"cj.phi\" = \"30 deg\" }

[[analysis.actuator]]
shaft = \"wg\"
cost = 120

[[analysis.sensor]]
shaft = \"rk\"
measures = \"angle\"
cost = 40
";

const LOG: &str = "\
[log.bench]
time = \"Time\"

[[log.bench.channel]]
signal = \"wg.phi\"
column = \"Encoder WG\"
unit = \"deg\"
factor = -1

[[log.bench.channel]]
signal = \"wg_motor.tau\"
column = \"Load cell\"
scale = \"20 N m\"
zero_samples = 100
";

const SIGNAL: &str = "\
[signal.knocks]
kind = \"pulses\"
high = \"5 N m\"
period = \"0.2 s\"
width = \"10 ms\"

[scenario]
duration = \"2 s\"
signals = { load = \"knocks + 2 N m * sin(2 pi t / 1 s)\" }
";

const IDENTIFICATION: &str = "\
[identification]
parameters = [\"wg.damping\", \"wg.friction\"]
window = \"50 ms\"
loss = \"huber\"

[[identification.extra]]
kind = \"stribeck\"
friction = \"wg\"

[[identification.candidate]]
name = \"viscous\"
parameters = [\"wg.damping\"]
";

/// The example on the page of such a table.
const TABLE: &str = "\
[table.engine]
points = { x = [\"1000 rpm\", \"2500 rpm\", \"5000 rpm\"], value = [\"150 N m\", \"210 N m\", \"140 N m\"] }
interpolation = \"cubic\"
";

const BLOCK: &str = "\
[block.lead]
kind = \"lead_lag\"
input = \"torque_sensor.tau\"
lead = \"20 ms\"
lag = \"4 ms\"
sample_time = \"1 ms\"

[control.assist]
law = \"program\"
commands = { motor = \"3 * lead - 0.01 N m s/rad * rotor.w\" }
sample_time = \"1 ms\"
";

pub(super) fn example_of(page: &str) -> &'static str {
    match page {
        "model" => MODEL,
        "scenario" => SCENARIO,
        "event" => EVENT,
        "fault" => FAULT,
        "safety" => SAFETY,
        "sweep" => SWEEP,
        "requirement" => REQUIREMENT,
        "manoeuvre" => MANOEUVRE,
        "path" => PATH,
        "figure" => FIGURE,
        "plot" => PLOT,
        "variant" => VARIANT,
        "analysis" => ANALYSIS,
        "table" => TABLE,
        "log" => LOG,
        "signal" => SIGNAL,
        "block" => BLOCK,
        "identification" => IDENTIFICATION,
        "bench" => BENCH,
        _ => "",
    }
}
