//! Tests of `src/commands/cluster/record.rs`.

use super::*;

#[test]
fn a_record_is_read_as_it_was_written_and_nothing_else_is() {
    let jobs = vec!["slurm 41".to_string(), "local checksum".into()];
    let record = Record { sweep: "kardan 0.1.0, model 1".into(), shards: 7, jobs };
    let text = record.to_text();
    assert_eq!(Record::read(text.as_bytes()), Ok(record));
    for at in 0..text.len() {
        for bit in 0..8 {
            let mut damaged = text.clone().into_bytes();
            damaged[at] ^= 1 << bit;
            assert!(Record::read(&damaged).is_err(), "bit {bit} of {at}");
        }
        assert!(Record::read(&text.as_bytes()[..at]).is_err(), "{at} bytes");
    }
    assert!(Record::read((text + "job slurm 42\n").as_bytes()).is_err());
    for shards in ["0", "1001", "18446744073709551616", "-1", "", "1e3"] {
        let lines = format!("sweep kardan 0\nshards {shards}\n");
        let why = Record::read((lines.clone() + &checksum(&lines)).as_bytes()).unwrap_err();
        assert!(why.contains(&format!("`shards {shards}`")), "{why}");
    }
}
