//! The Arrow schema of Parquet files under [`KEY`], the only place for metadata of a column.
//!
//! Readers that use it take the metadata of the table from it too, in place of those of the file.
//!
//! The value is an encapsulated message of Arrow's IPC format in base64. The numbers below are the slots and codes of
//! `format/Message.fbs` and `format/Schema.fbs` of Apache Arrow; a slot left out has its default: not nullable, little
//! endian, no body.

use flatbuffers::{FlatBufferBuilder, ForwardsUOffset, TableFinishedWIPOffset, VOffsetT, Vector, WIPOffset};

use crate::Column;
use crate::text::BASE64;

/// The key in the metadata of the file.
pub const KEY: &str = "ARROW:schema";

const METADATA_VERSION_5: i16 = 4;
const HEADER_SCHEMA: u8 = 1;
const TYPE_FLOATING_POINT: u8 = 3;
const PRECISION_DOUBLE: i16 = 2;

type Pair<'a> = (&'a str, &'a str);
type Builder = FlatBufferBuilder<'static>;
type Table = WIPOffset<TableFinishedWIPOffset>;

/// Gives the schema of required `double` columns, each with its `unit` and `description`, and of a table with metadata.
pub fn arrow_schema(columns: &[Column], metadata: &[Pair]) -> String {
    let mut builder = Builder::new();
    let fields: Vec<_> = columns.iter().map(|column| field(&mut builder, column)).collect();
    let fields = builder.create_vector(&fields);
    let metadata = pairs(&mut builder, metadata);
    let schema = table(&mut builder, |schema| {
        schema.push_slot_always(slot(1), fields);
        schema.push_slot_always(slot(2), metadata);
    });
    let message = table(&mut builder, |message| {
        message.push_slot_always(slot(0), METADATA_VERSION_5);
        message.push_slot_always(slot(1), HEADER_SCHEMA);
        message.push_slot_always(slot(2), schema);
    });
    builder.finish_minimal(message);
    base64(&encapsulated(builder.finished_data()))
}

fn field(builder: &mut Builder, column: &Column) -> Table {
    let metadata = pairs(builder, &[("unit", column.unit), ("description", column.description)]);
    let children = builder.create_vector::<Table>(&[]);
    let double = table(builder, |float| float.push_slot_always(slot(0), PRECISION_DOUBLE));
    let name = builder.create_string(column.name);
    table(builder, |field| {
        field.push_slot_always(slot(0), name);
        field.push_slot_always(slot(2), TYPE_FLOATING_POINT);
        field.push_slot_always(slot(3), double);
        field.push_slot_always(slot(5), children);
        field.push_slot_always(slot(6), metadata);
    })
}

fn pairs(builder: &mut Builder, pairs: &[Pair]) -> WIPOffset<Vector<'static, ForwardsUOffset<TableFinishedWIPOffset>>> {
    let pair = |&(key, value): &Pair| {
        let (key, value) = (builder.create_string(key), builder.create_string(value));
        table(builder, |pair| {
            pair.push_slot_always(slot(0), key);
            pair.push_slot_always(slot(1), value);
        })
    };
    let pairs: Vec<_> = pairs.iter().map(pair).collect();
    builder.create_vector(&pairs)
}

fn table(builder: &mut Builder, fill: impl FnOnce(&mut Builder)) -> Table {
    let start = builder.start_table();
    fill(builder);
    builder.end_table(start)
}

/// A slot's place in the vtable: after two lengths of two bytes.
const fn slot(index: VOffsetT) -> VOffsetT {
    4 + 2 * index
}

/// Puts the continuation marker and the size before a message and pads it to eight bytes.
fn encapsulated(message: &[u8]) -> Vec<u8> {
    let size = message.len().next_multiple_of(8);
    let mut bytes = vec![0xff; 4];
    bytes.extend(i32::try_from(size).expect("a schema is far below 2 GiB").to_le_bytes());
    bytes.extend(message);
    bytes.resize(8 + size, 0);
    bytes
}

/// RFC 4648, with padding.
fn base64(bytes: &[u8]) -> String {
    let digits = bytes.chunks(3).flat_map(|chunk| {
        let byte = |i| chunk.get(i).copied().unwrap_or(0);
        let word = u32::from_be_bytes([0, byte(0), byte(1), byte(2)]);
        let digit = move |i| BASE64[(word >> (18 - 6 * i)) as usize & 63].into();
        [digit(0), digit(1), if chunk.len() > 1 { digit(2) } else { '=' }, if chunk.len() > 2 { digit(3) } else { '=' }]
    });
    digits.collect()
}

#[cfg(test)]
#[path = "../../tests/unit/write/arrow_schema.rs"]
mod tests;
