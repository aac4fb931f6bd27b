//! Tests of `src/commands/cluster/template.rs`.

use super::*;

#[test]
fn placeholders_are_replaced_and_unknown_ones_refused() {
    let values = [("shard", "sh x".to_string()), ("list", "1 {{shard}}".into())];
    assert_eq!(fill("t", "a {{ shard }} ${X} {y} {{list}}", &values).unwrap(), "a sh x ${X} {y} 1 {{shard}}");
    for (text, expected) in
        [("\n{{shar}}", "line 2"), ("{{shard\n}}", "without"), ("{{}}", "no `{{}}`"), ("{{", "line 1")]
    {
        let diagnostic = fill("t", text, &values).unwrap_err();
        assert!(diagnostic.message.contains(expected), "{}", diagnostic.message);
    }
    assert!(fill("t", "{{shar}}", &values).unwrap_err().help.unwrap().contains("did you mean `{{shard}}`"));
    assert!(check("t", "{{shard}} {{list}}").is_ok() && check("t", "{{ shard }} {{array}}").is_ok());
    assert!(check("t", "shard {{list}}").is_err() && check("t", "{{shard}} 1").is_err());
}

#[test]
fn ranges_are_short() {
    assert_eq!(ranges(&[1, 2, 3, 7, 9, 10]), "1-3,7,9-10");
    assert_eq!(ranges(&[]), "");
}
