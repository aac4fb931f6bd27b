//! The structure analysis of a model as one JSON object.

use serde_json::{Value, json as object};

use crate::results::{
    Analysis, Basis, BoxVerdict, Breach, Certificate, Class, Complex, ConstraintForces, Construction, Count,
    Elimination, EnergyKind, Entry, Factor, FailingMode, FrictionState, Invariant, LossSearch, Minor, Mode,
    NamedMatrix, NamedShare, ParameterPoint, ParameterRange, PlacedSet, Placement, PlacementSearch, Pole, Sensitivity,
    ShaftAngle, ShapePart, StoredShare, Structure,
};

/// Gives an analysis as one JSON object on one line, in SI; a number that is not finite is `null`, a complex number is
/// `[re, im]`, an exact one a text (`"-3/2"`), an index counts from 0, and a part that does not apply is `null` or empty.
///
/// Keys, always in this order:
///
/// | key | what it is |
/// |---|---|
/// | `name`, `description` | the model |
/// | `class` | `constant_linear`; `assumptions`: `statement`, `holds`, `breaches` (`element`, `why`); `constraints`: `element`, `equation`, `equality`, `holonomic`, `scleronomic`, `linear`; `operating_point`: `angles` (`shaft`, `angle_rad`), `friction` (`element`, `coulomb_torque_N_m`, `stuck`) |
/// | `coordinates` | names of the reduced coordinates |
/// | `elimination` | motions without inertia, `null` if there was none to eliminate: `motions`, `direction`, `removed` (states that are none any more), `definitions` (`state`, `is`) |
/// | `modes` | `eigenvalue_per_s`, `frequency_Hz`, `natural_frequency_rad_per_s`, `damping_ratio`, `shape` (`name`, `value`: complex, relative to the largest), `stored` (`element`, `energy`: `kinetic` or `potential`, `share`), `dissipated` (`element`, `share`), `factor`, `controllable`, `observable` |
/// | `controllable`, `observable`, `minimal` | booleans; `null` where a proof was asked for and not found: then all that rests on it is `null` too |
/// | `uncontrollable`, `unobservable` | modes: `eigenvalue_per_s`, `factor`, `defect`, `shafts` (`name`, `share` of the largest), `elements` (`name`, `share` of the stored energy) |
/// | `controllable_rank`, `observable_rank` | whole numbers |
/// | `states`, `state_names`, `inputs`, `outputs` | the number of states; names |
/// | `relative_degrees` | `outputs`, `inputs`; `table`, a row for each output, `null` where the input never reaches it; `per_output`, the least of each row |
/// | `zeros` | `polynomial`, `values` in 1/s, `in_right_half_plane` (how many, exact; `null`: not decided), `normal_rank` |
/// | `kind` | the case of the theorems on least numbers: `general`, `pure damping`, `no damping`, `state space` |
/// | `min_inputs`, `min_outputs` | whole numbers |
/// | `factors` | of the characteristic polynomial: `polynomial`, `roots_per_s`, `algebraic`, `geometric`, `input_defect`, `output_defect` |
/// | `invariant_factors` | of sI − A, each dividing the next |
/// | `construction` | inputs of the least number, built factor by factor: `rows` (coordinates that forces act on, or states), `input` (texts), `steps`: `factor`, `defect` (rank defect before), `column`, `direction` and `multiplier` of what was added |
/// | `placements` | sets of places, best first, motors before sensors: `inputs` or `outputs` (the places), `score`, `unit` (of the score), `cost`, `efficient` (whether every better set costs more) |
/// | `placement_search` | `inputs`, `outputs`, each `method`, `exhaustive`, `gap`, `tried`, `candidates` (`place`, `cost`), `measure`, `unit`, `larger_is_better`, `none_because` |
/// | `sensitivity` | `parameters`: `name`, `nominal`, `lower`, `upper`, `unit`; `controllability`, `observability`: `nearest` (`distance_tolerances`, `at`: `parameter`, `value`, `unit`; `eigenvalue_per_s`, `residual`, `shafts`), `starts` of the search, `proven_distance_tolerances`, `box` (`certified`, `lost` or `not certified`), `method`, `sampling` (`samples`, `seed`, `threshold`, `unit`, `probability`, `interval_95`, `smallest`, `median`, `largest`) |
/// | `bases` | `name`, `basis`, `inertia`, `damping`, `stiffness`, `input` (matrices: `title`, `unit`, `rows`, `columns`, `values`), `orthogonality`, `bounds` (`matrix`, `unit`, `eigenvalues`, `centres`, `radii`) |
/// | `constraint_forces` | `projector`, `rank`, `idempotence_residual`, `input_to_torque`, `input_to_multiplier` |
/// | `certificate` | `proven`, `failure_probability`, `primes` (those of the minors and proofs; what is not proven was decided modulo others, drawn anew each time), `statements`; `pencil`: E, A, B, C, D of `E x' = A x + B u`, `y = C x + D u`, each a list of `[row, column, "value"]`; `inputs`, `outputs`: `number`, `witness`, `minor`, `common_factor` (coefficients of 1, s, s², …), `rows`; `unreached`, `unseen`: `rows` Y and `action` M with `Y A = M Y E`, `Y B = 0`; `reached`, `seen`: `prime`, `columns` (`[input, power]`), `rows`, `value`. Those for outputs are about the transposed pencil. Whole numbers may exceed 2⁵³. |
/// | `notes` | sentences |
/// | `complete`, `unfinished` | whether nothing ended early; else why it did and what is missing (such parts are empty), `null` if nothing is |
pub fn analysis_json(analysis: &Analysis) -> String {
    let structure = &analysis.structure;
    object!({
        "name": analysis.name,
        "description": analysis.description,
        "class": analysis.class.as_ref().map(class),
        "coordinates": analysis.coordinates,
        "elimination": analysis.elimination.as_ref().map(elimination),
        "modes": list(&analysis.modes, |found| mode(found, structure)),
        "controllable": structure.controllability(),
        "observable": structure.observability(),
        "minimal": structure.minimality(),
        "uncontrollable": list(&structure.uncontrollable, failing),
        "unobservable": list(&structure.unobservable, failing),
        "controllable_rank": structure.controllability().map(|_| structure.controllable_rank),
        "observable_rank": structure.observability().map(|_| structure.observable_rank),
        "states": structure.states.len(),
        "state_names": structure.states,
        "inputs": structure.inputs,
        "outputs": structure.outputs,
        "relative_degrees": relative_degrees(structure),
        "zeros": {
            "polynomial": structure.zeros.polynomial,
            "values": list(&structure.zeros.values, pole),
            "in_right_half_plane": structure.zeros.growing,
            "normal_rank": structure.zeros.normal_rank,
        },
        "kind": structure.kind,
        "min_inputs": structure.min_inputs,
        "min_outputs": structure.min_outputs,
        "factors": list(&structure.factors, |found| factor(found, structure)),
        "invariant_factors": structure.invariant_factors,
        "construction": structure.construction.as_ref().map(construction),
        "placements": placements(&analysis.placement),
        "placement_search": {
            "inputs": analysis.placement.inputs.as_ref().map(search),
            "outputs": analysis.placement.outputs.as_ref().map(search),
        },
        "sensitivity": analysis.sensitivity.as_ref().map(sensitivity),
        "bases": list(&analysis.bases, basis),
        "constraint_forces": analysis.constraint_forces.as_ref().map(constraint_forces),
        "certificate": certificate(&structure.certificate),
        "notes": analysis.notes,
        "complete": analysis.unfinished.is_none(),
        "unfinished": analysis.unfinished,
    })
    .to_string()
}

/// What a run says of the structure of its model; keys and values are those of [`analysis_json`].
pub(super) fn analysis_in_short(analysis: &Analysis) -> Value {
    let structure = &analysis.structure;
    let poles = |mode: &Mode| pole(&mode.eigenvalue);
    object!({
        "inputs": structure.inputs,
        "outputs": structure.outputs,
        "states": structure.states.len(),
        "controllable": structure.controllable(),
        "observable": structure.observable(),
        "controllable_rank": structure.controllable_rank,
        "observable_rank": structure.observable_rank,
        "min_inputs": structure.min_inputs,
        "min_outputs": structure.min_outputs,
        "eigenvalues_per_s": list(&analysis.modes, poles),
        "zeros": list(&structure.zeros.values, pole),
        "notes": analysis.notes,
    })
}

fn list<T>(items: &[T], one: impl Fn(&T) -> Value) -> Vec<Value> {
    items.iter().map(one).collect()
}

fn pole(pole: &Pole) -> Value {
    object!([pole.re, pole.im])
}

fn shares(shares: &[NamedShare]) -> Vec<Value> {
    list(shares, |one| object!({ "name": one.name, "share": one.share }))
}

fn class(class: &Class) -> Value {
    let point = &class.operating_point;
    object!({
        "constant_linear": class.constant_linear,
        "assumptions": list(&class.assumptions, |assumption| object!({
            "statement": assumption.statement,
            "holds": assumption.holds,
            "breaches": list(&assumption.breaches, |Breach { element, why }| object!({ "element": element, "why": why })),
        })),
        "constraints": list(&class.constraints, |constraint| object!({
            "element": constraint.element,
            "equation": constraint.equation,
            "equality": constraint.equality,
            "holonomic": constraint.holonomic,
            "scleronomic": constraint.scleronomic,
            "linear": constraint.linear,
        })),
        "operating_point": {
            "angles": list(&point.angles, |ShaftAngle { shaft, angle }| object!({ "shaft": shaft, "angle_rad": angle })),
            "friction": list(&point.friction, |FrictionState { element, coulomb_torque: torque, stuck }| object!({
                "element": element, "coulomb_torque_N_m": torque, "stuck": stuck,
            })),
        },
    })
}

fn elimination(elimination: &Elimination) -> Value {
    object!({
        "motions": elimination.motions,
        "direction": elimination.direction,
        "removed": elimination.removed,
        "definitions": list(&elimination.definitions, |one| object!({ "state": one.state, "is": one.is })),
    })
}

fn mode(mode: &Mode, structure: &Structure) -> Value {
    let kind = |kind: &EnergyKind| match kind {
        EnergyKind::Kinetic => "kinetic",
        EnergyKind::Potential => "potential",
    };
    object!({
        "eigenvalue_per_s": pole(&mode.eigenvalue),
        "frequency_Hz": mode.natural_frequency / std::f64::consts::TAU,
        "natural_frequency_rad_per_s": mode.natural_frequency,
        "damping_ratio": mode.damping_ratio,
        "shape": list(&mode.shape, |ShapePart { name, value: Complex { re, im } }| object!({ "name": name, "value": [re, im] })),
        "stored": list(&mode.stored, |StoredShare { element, energy: stored, share }| object!({
            "element": element, "energy": kind(stored), "share": share,
        })),
        "dissipated": list(&mode.dissipated, |one| object!({ "element": one.element, "share": one.share })),
        "factor": mode.factor,
        "controllable": structure.controllability().map(|_| mode.controllable),
        "observable": structure.observability().map(|_| mode.observable),
    })
}

fn failing(mode: &FailingMode) -> Value {
    object!({
        "eigenvalue_per_s": pole(&mode.eigenvalue),
        "factor": mode.factor,
        "defect": mode.defect,
        "shafts": shares(&mode.shafts),
        "elements": shares(&mode.elements),
    })
}

fn relative_degrees(structure: &Structure) -> Value {
    let least = |row: &Vec<Option<usize>>| object!(row.iter().flatten().min());
    object!({
        "outputs": structure.outputs,
        "inputs": structure.inputs,
        "table": structure.relative_degrees,
        "per_output": list(&structure.relative_degrees, least),
    })
}

fn factor(factor: &Factor, structure: &Structure) -> Value {
    object!({
        "polynomial": factor.polynomial,
        "roots_per_s": list(&factor.roots, pole),
        "algebraic": factor.algebraic,
        "geometric": factor.geometric,
        "input_defect": structure.controllability().map(|_| factor.input_defect),
        "output_defect": structure.observability().map(|_| factor.output_defect),
    })
}

fn construction(construction: &Construction) -> Value {
    object!({
        "rows": construction.rows,
        "input": construction.input,
        "steps": list(&construction.steps, |step| object!({
            "factor": step.factor,
            "defect": step.defect,
            "column": step.column,
            "direction": step.direction,
            "multiplier": step.multiplier,
        })),
    })
}

fn placements(placement: &Placement) -> Vec<Value> {
    let sets = |search: &Option<PlacementSearch>, key: &str| {
        let search = search.iter();
        let sets = search.flat_map(|search| search.sets.iter().map(move |set| (set, &search.unit)));
        let one = |(set, unit)| {
            let set: &PlacedSet = set;
            object!({ key: set.places, "score": set.score, "unit": unit, "cost": set.cost, "efficient": set.efficient })
        };
        sets.map(one).collect::<Vec<Value>>()
    };
    [sets(&placement.inputs, "inputs"), sets(&placement.outputs, "outputs")].concat()
}

fn search(search: &PlacementSearch) -> Value {
    object!({
        "method": search.method,
        "exhaustive": search.exhaustive,
        "gap": search.gap,
        "tried": search.tried,
        "candidates": list(&search.candidates, |one| object!({ "place": one.place, "cost": one.cost })),
        "measure": search.measure,
        "unit": search.unit,
        "larger_is_better": search.larger_is_better,
        "none_because": search.none_because,
    })
}

fn sensitivity(sensitivity: &Sensitivity) -> Value {
    object!({
        "parameters": list(&sensitivity.parameters, |ParameterRange { name, nominal, lower, upper, unit }| object!({
            "name": name, "nominal": nominal, "lower": lower, "upper": upper, "unit": unit,
        })),
        "controllability": sensitivity.controllability.as_ref().map(loss_search),
        "observability": sensitivity.observability.as_ref().map(loss_search),
    })
}

fn loss_search(search: &LossSearch) -> Value {
    object!({
        "nearest": search.nearest.as_ref().map(|loss| object!({
            "distance_tolerances": loss.distance,
            "at": list(&loss.at, |ParameterPoint { parameter, value, unit }| object!({
                "parameter": parameter, "value": value, "unit": unit,
            })),
            "eigenvalue_per_s": pole(&loss.eigenvalue),
            "residual": loss.residual,
            "shafts": shares(&loss.shafts),
        })),
        "starts": search.starts,
        "proven_distance_tolerances": search.proven_distance,
        "box": match search.box_verdict {
            BoxVerdict::Certified => "certified",
            BoxVerdict::Lost => "lost",
            BoxVerdict::NotCertified => "not certified",
        },
        "method": search.method,
        "sampling": search.sampling.as_ref().map(|sampling| object!({
            "samples": sampling.samples,
            "seed": sampling.seed,
            "threshold": sampling.threshold,
            "unit": sampling.unit,
            "probability": sampling.probability,
            "interval_95": [sampling.interval.lower, sampling.interval.upper],
            "smallest": sampling.smallest,
            "median": sampling.median,
            "largest": sampling.largest,
        })),
    })
}

fn matrix(matrix: &NamedMatrix) -> Value {
    object!({
        "title": matrix.title,
        "unit": matrix.unit,
        "rows": matrix.rows,
        "columns": matrix.columns,
        "values": matrix.values,
    })
}

fn basis(basis: &Basis) -> Value {
    object!({
        "name": basis.name,
        "basis": matrix(&basis.basis),
        "inertia": matrix(&basis.inertia),
        "damping": matrix(&basis.damping),
        "stiffness": matrix(&basis.stiffness),
        "input": matrix(&basis.input),
        "orthogonality": basis.orthogonality,
        "bounds": list(&basis.bounds, |bounds| object!({
            "matrix": bounds.matrix,
            "unit": bounds.unit,
            "eigenvalues": bounds.eigenvalues,
            "centres": bounds.centres,
            "radii": bounds.radii,
        })),
    })
}

fn constraint_forces(forces: &ConstraintForces) -> Value {
    object!({
        "projector": matrix(&forces.projector),
        "rank": forces.rank,
        "idempotence_residual": forces.idempotence_residual,
        "input_to_torque": matrix(&forces.input_to_torque),
        "input_to_multiplier": matrix(&forces.input_to_multiplier),
    })
}

fn certificate(certificate: &Certificate) -> Value {
    let entries = |entries: &Vec<Entry>| list(entries, |entry| object!([entry.row, entry.column, entry.value]));
    let pencil = certificate.pencil.iter().map(|one| (one.name.clone(), Value::from(entries(&one.entries))));
    object!({
        "proven": certificate.proven,
        "failure_probability": certificate.failure_probability,
        "primes": certificate.primes,
        "statements": certificate.statements,
        "pencil": pencil.collect::<serde_json::Map<_, _>>(),
        "inputs": certificate.inputs.as_ref().map(count),
        "outputs": certificate.outputs.as_ref().map(count),
        "unreached": certificate.unreached.as_ref().map(invariant),
        "unseen": certificate.unseen.as_ref().map(invariant),
        "reached": certificate.reached.as_ref().map(minor),
        "seen": certificate.seen.as_ref().map(minor),
    })
}

fn count(count: &Count) -> Value {
    object!({
        "number": count.number,
        "witness": count.witness,
        "minor": minor(&count.minor),
        "common_factor": count.common_factor,
        "rows": count.rows,
    })
}

fn minor(minor: &Minor) -> Value {
    let columns = list(&minor.columns, |one| object!([one.input, one.power]));
    object!({ "prime": minor.prime, "columns": columns, "rows": minor.rows, "value": minor.value })
}

fn invariant(invariant: &Invariant) -> Value {
    object!({ "rows": invariant.rows, "action": invariant.action })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::example;

    const KEYS: [&str; 34] = [
        "name",
        "description",
        "class",
        "coordinates",
        "elimination",
        "modes",
        "controllable",
        "observable",
        "minimal",
        "uncontrollable",
        "unobservable",
        "controllable_rank",
        "observable_rank",
        "states",
        "state_names",
        "inputs",
        "outputs",
        "relative_degrees",
        "zeros",
        "kind",
        "min_inputs",
        "min_outputs",
        "factors",
        "invariant_factors",
        "construction",
        "placements",
        "placement_search",
        "sensitivity",
        "bases",
        "constraint_forces",
        "certificate",
        "notes",
        "complete",
        "unfinished",
    ];

    fn read(analysis: &Analysis) -> Value {
        let text = analysis_json(analysis);
        assert!(!text.contains('\n'));
        serde_json::from_str(&text).unwrap()
    }

    #[test]
    fn the_keys_are_the_documented_ones_in_their_order() {
        for analysis in [Analysis::default(), example::two_bodies(), example::train(), example::hostile("<\"\n")] {
            let all = read(&analysis);
            assert_eq!(all.as_object().unwrap().keys().collect::<Vec<_>>(), KEYS);
        }
    }

    #[test]
    fn two_bodies_are_typed_as_promised() {
        let all = read(&example::two_bodies());
        assert_eq!([&all["states"], &all["controllable_rank"], &all["observable_rank"]], [4, 3, 3]);
        assert_eq!([&all["min_inputs"], &all["min_outputs"]], [2, 2]);
        assert_eq!([&all["controllable"], &all["observable"], &all["minimal"]], [false, false, false]);
        assert_eq!(all["state_names"][2], "body_1.w");
        assert_eq!(all["uncontrollable"][0]["shafts"], object!([{ "name": "body_2", "share": 1.0 }]));
        assert_eq!(all["uncontrollable"][0]["eigenvalue_per_s"], object!([-1.0, 0.0]));
        assert_eq!(
            all["zeros"],
            object!({ "polynomial": "s + 1", "values": [[-1.0, 0.0]], "in_right_half_plane": 0, "normal_rank": 1 })
        );
        assert_eq!(all["relative_degrees"]["table"], object!([[3]]));
        assert_eq!(all["class"]["assumptions"].as_array().unwrap().len(), 5);
        assert_eq!(all["modes"][1]["stored"][2]["energy"], "potential");
        assert_eq!(all["construction"]["input"], object!([["1", "0"], ["0", "1"]]));
        assert_eq!(all["construction"]["steps"][1]["column"], 1);
        assert_eq!(all["placements"][0]["inputs"], object!(["body_1", "body_2"]));
        assert_eq!(all["placements"][1]["outputs"], object!(["body_1.phi", "body_2.phi"]));
        assert_eq!(all["placements"][0]["unit"], "rad^2");
        assert_eq!(all["constraint_forces"], Value::Null);
        assert_eq!(all["sensitivity"]["observability"]["box"], "lost");
        assert_eq!(all["certificate"]["primes"][0].as_u64(), Some((1 << 61) - 1));
    }

    #[test]
    fn what_never_arrives_and_what_is_not_finite_is_null() {
        let train = read(&example::train());
        assert_eq!(train["relative_degrees"]["table"], object!([[2, 4], [1, null], [null, 1]]));
        assert_eq!(train["relative_degrees"]["per_output"], object!([2, 1, 1]));
        assert_eq!(train["placement_search"]["inputs"]["gap"], 0.125);
        assert_eq!(train["placements"].as_array().unwrap().len(), 14);
        assert!(train["placement_search"]["outputs"]["none_because"].as_str().unwrap().contains("flexspline"));
        assert_eq!(train["sensitivity"]["controllability"]["sampling"]["interval_95"], object!([0.0007, 0.0021]));
        let hostile = read(&example::hostile("x"));
        assert_eq!(hostile["modes"][1]["eigenvalue_per_s"], object!([null, null]));
        assert_eq!(hostile["certificate"]["failure_probability"], Value::Null);
    }

    /// The certificate of the JSON object alone shows that body 2 is not reached: `Y A = M Y E` and `Y B = 0`.
    #[test]
    fn the_certificate_can_be_checked_from_the_text() {
        let all = read(&example::two_bodies());
        let certificate = &all["certificate"];
        let states = all["states"].as_u64().unwrap() as usize;
        let number = |value: &Value| value.as_str().unwrap().parse::<i64>().unwrap();
        let row: Vec<i64> = certificate["unreached"]["rows"][0].as_array().unwrap().iter().map(number).collect();
        let times = |name: &str| {
            let mut product = vec![0; states];
            for entry in certificate["pencil"][name].as_array().unwrap() {
                let at = |k: usize| entry[k].as_u64().unwrap() as usize;
                product[at(1)] += row[at(0)] * number(&entry[2]);
            }
            product
        };
        let action = number(&certificate["unreached"]["action"][0][0]);
        assert_eq!(times("A"), times("E").iter().map(|value| action * value).collect::<Vec<_>>());
        assert_eq!(times("B"), [0; 4]);
    }
}
