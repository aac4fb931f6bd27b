//! Tests of `src/names/list.rs`.

use super::*;

/// Short and long lists find the same entries as a linear search.
#[test]
fn entries_are_those_of_looking_through() {
    for count in 0..4 * LINEAR_SEARCH_LIMIT {
        let mut list: NamedList<(String, usize)> = (0..count).map(|k| (format!("x{}", k % 7), k)).collect();
        for step in [1, 3] {
            list.retain(|(_, k)| k % step == 0);
            list.push(("last".into(), count));
            for name in ["x0", "x3", "x6", "last", "none"] {
                let all: Vec<_> = list.iter().filter(|entry| entry.0 == name).collect();
                assert_eq!(list.all(name).collect::<Vec<_>>(), all, "{name} of {count}");
                assert_eq!(list.get(name), all.first().copied());
                assert_eq!(list.has(name), !all.is_empty());
            }
        }
    }
}
