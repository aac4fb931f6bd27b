//! The colours of the page, by computation: contrast after WCAG 2.2 (AA), and curves that stay apart for every kind of colour
//! blindness.

use std::collections::BTreeMap;

use kardan::results::Study;

/// Text on its ground (WCAG 1.4.3), and what is drawn (1.4.11).
const TEXT: f64 = 4.5;
const DRAWN: f64 = 3.0;
/// Least distance of two curves in CIE L*a*b* (ΔE of 1976): the eye tells 2.3 apart side by side.
const APART: f64 = 15.0;

/// Red, green and blue from 0 to 1, linear in the light.
type Light = [f64; 3];

fn light(colour: &str) -> Light {
    let digits = colour.trim_start_matches('#');
    let short = digits.len() == 3;
    [0, 1, 2].map(|k| {
        let part = if short { digits[k..=k].repeat(2) } else { digits[2 * k..2 * k + 2].into() };
        let value = f64::from(u8::from_str_radix(&part, 16).expect("a colour")) / 255.0;
        if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    })
}

/// The relative luminance of WCAG.
fn luminance([r, g, b]: Light) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

fn contrast(one: &str, other: &str) -> f64 {
    let [a, b] = [one, other].map(|colour| luminance(light(colour)) + 0.05);
    a.max(b) / a.min(b)
}

/// CIE L*a*b* under D65.
fn lab(light: Light) -> [f64; 3] {
    let [r, g, b] = light.map(|part| part.clamp(0.0, 1.0));
    let xyz = [
        (0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / 0.950_47,
        0.212_672_9 * r + 0.715_152_2 * g + 0.072_175_0 * b,
        (0.019_333_9 * r + 0.119_192_0 * g + 0.950_304_1 * b) / 1.088_83,
    ];
    let bent = |t: f64| if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 };
    let [x, y, z] = xyz.map(bent);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// How each eye sees, as matrices on linear light: Machado, Oliveira and Fernandes (2009), full severity.
const EYES: [(&str, [[f64; 3]; 3]); 4] = [
    ("normal", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    (
        "protanopia",
        [[0.152_286, 1.052_583, -0.204_868], [0.114_503, 0.786_281, 0.099_216], [-0.003_882, -0.048_116, 1.051_998]],
    ),
    (
        "deuteranopia",
        [[0.367_322, 0.860_646, -0.227_968], [0.280_085, 0.672_501, 0.047_413], [-0.011_820, 0.042_940, 0.968_881]],
    ),
    (
        "tritanopia",
        [[1.255_528, -0.076_749, -0.178_779], [-0.078_411, 0.930_809, 0.147_602], [0.004_733, 0.691_367, 0.303_900]],
    ),
];

fn distance(one: &str, other: &str, eye: &[[f64; 3]; 3]) -> f64 {
    let perceived = |colour: &str| {
        let linear = light(colour);
        lab(eye.map(|row| row[0] * linear[0] + row[1] * linear[1] + row[2] * linear[2]))
    };
    let (a, b) = (perceived(one), perceived(other));
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// The custom properties of a page in light, in dark and on paper; each begins with those of light.
fn schemes() -> [(&'static str, BTreeMap<String, String>); 3] {
    let page = kardan_report::study(&Study::default()).html();
    let (_, style) = page.split_once("<style>").expect("a style sheet");
    let (style, _) = style.split_once("</style>").expect("its end");
    let mut all = [("light", BTreeMap::new()), ("dark", BTreeMap::new()), ("paper", BTreeMap::new())];
    let mut before = "";
    let mut remaining = style;
    while let Some((head, tail)) = remaining.split_once(":root") {
        let text = head.trim_end();
        let medium = text.strip_suffix('{').and_then(|text| text.rsplit('}').next()).unwrap_or(before).trim();
        let (body, tail) = tail.split_once('}').expect("a rule ends");
        let properties = body.trim_start_matches([' ', '{']).split(';').filter_map(|one| one.split_once(':'));
        let properties: Vec<(String, String)> = properties
            .filter_map(|(name, value)| Some((name.trim().strip_prefix("--")?.into(), value.trim().into())))
            .collect();
        for (scheme, scheme_properties) in &mut all {
            let applies = if medium.contains("dark") {
                *scheme == "dark"
            } else if medium.contains("print") {
                *scheme == "paper"
            } else {
                true
            };
            if applies {
                scheme_properties.extend(properties.iter().cloned());
            }
        }
        (before, remaining) = ("", tail);
    }
    all
}

#[test]
fn the_formulas_agree_with_reference_values() {
    // WCAG: black on white; #767676 is the well-known lightest grey of contrast 4.5.
    assert!((contrast("#000", "#ffffff") - 21.0).abs() < 1e-9);
    assert!(contrast("#767676", "#fff") > 4.5 && contrast("#777777", "#fff") < 4.5);
    // L*a*b* of sRGB's red under D65: 53.24, 80.09, 67.20.
    let red = lab(light("#ff0000"));
    for (found, expected) in red.into_iter().zip([53.24, 80.09, 67.20]) {
        assert!((found - expected).abs() < 0.02, "{found} {expected}");
    }
    // White is white to every eye.
    for (eye, matrix) in EYES {
        let [r, g, b] = matrix.map(|row| row.iter().sum::<f64>());
        assert!([r, g, b].iter().all(|part| (part - 1.0).abs() < 1e-5), "{eye}");
    }
}

#[test]
fn every_text_and_curve_has_contrast_to_its_ground() {
    for (scheme, of) in schemes() {
        let colour = |name: &str| of.get(name).unwrap_or_else(|| panic!("{scheme}: no --{name} among {of:?}")).as_str();
        let texts = [
            ("ink", "paper"),
            ("ink", "raised"),
            ("faint", "paper"),
            ("accent", "paper"),
            ("accent", "raised"),
            ("good", "paper"),
            ("good", "good-back"),
            ("bad", "paper"),
            ("bad", "bad-back"),
            ("ink", "bad-back"),
        ];
        for (text, ground) in texts {
            let found = contrast(colour(text), colour(ground));
            assert!(found >= TEXT, "{scheme}: --{text} on --{ground} has a contrast of {found:.2}");
        }
        for k in 0..7 {
            let found = contrast(colour(&format!("curve-{k}")), colour("paper"));
            assert!(found >= DRAWN, "{scheme}: curve {k} has a contrast of {found:.2}");
        }
    }
}

#[test]
fn curves_stay_apart_for_every_eye() {
    for (scheme, of) in schemes() {
        let curves: Vec<&String> = (0..7).map(|k| &of[&format!("curve-{k}")]).collect();
        for (eye, matrix) in &EYES {
            for (k, one) in curves.iter().enumerate() {
                for other in &curves[..k] {
                    let found = distance(one, other, matrix);
                    assert!(found >= APART, "{scheme}, {eye}: {one} and {other} are {found:.1} apart");
                }
            }
        }
    }
}
