//! ASAM MDF files.

use crate::{Column, Table};

/// Gives tables as an MDF file (version 4.10, sorted, not compressed): a group for each raster with its name, its time
/// in s as master and one channel of doubles for each column, bit for bit, with units and descriptions.
///
/// # Panics
/// If the length of a column differs from that of the time of its raster.
///
/// ```
/// use kardan_tables::{Column, Table, read, write};
///
/// let angle = Column { name: "rk.phi", unit: "rad", description: "", values: &[0.5, 0.6] };
/// let bytes = write::mdf(&[("run", &Table { time: &[0.0, 0.1], columns: vec![angle] })]);
///
/// let log = read::open(read::in_memory(bytes), &Default::default()).unwrap();
/// assert_eq!((log.groups()[0].rows, log.groups()[0].channels[1].unit.as_str()), (Some(2), "rad"));
/// ```
pub fn mdf(rasters: &[(&str, &Table<'_>)]) -> Vec<u8> {
    let mut file = File { bytes: Vec::new() };
    file.bytes.extend(b"MDF     4.10    kardan  \0\0\0\0");
    file.bytes.extend(410u16.to_le_bytes());
    file.bytes.resize(64, 0);
    // Start time, two offsets, flags; start angle and distance.
    let header = file.block(b"HD", &[0; 6], &[0; 32]);
    let comment = file.text(b"MD", "<FHcomment><TX>written</TX><tool_id>kardan</tool_id><tool_vendor>kardan</tool_vendor><tool_version>1</tool_version></FHcomment>");
    let history = file.block(b"FH", &[0, comment], &[0; 16]);
    file.link(header, 1, history);
    let mut last = (header, 0);
    for (name, table) in rasters {
        let group = file.raster(name, table);
        file.link(last.0, last.1, group);
        last = (group, 0);
    }
    file.bytes
}

struct File {
    bytes: Vec<u8>,
}

impl File {
    /// Appends a block; returns its position.
    fn block(&mut self, id: &[u8; 2], links: &[u64], data: &[u8]) -> u64 {
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
        let at = self.bytes.len() as u64;
        self.bytes.extend(b"##");
        self.bytes.extend(id);
        self.bytes.extend([0; 4]);
        self.bytes.extend((24 + 8 * links.len() as u64 + data.len() as u64).to_le_bytes());
        self.bytes.extend((links.len() as u64).to_le_bytes());
        self.bytes.extend(links.iter().flat_map(|link| link.to_le_bytes()));
        self.bytes.extend(data);
        at
    }

    fn text(&mut self, id: &[u8; 2], text: &str) -> u64 {
        let mut bytes = text.as_bytes().to_vec();
        bytes.resize((bytes.len() + 1).next_multiple_of(8), 0);
        self.block(id, &[], &bytes)
    }

    /// Sets the target of a link of a block.
    fn link(&mut self, block: u64, index: usize, to: u64) {
        let at = block as usize + 24 + 8 * index;
        self.bytes[at..at + 8].copy_from_slice(&to.to_le_bytes());
    }

    fn raster(&mut self, name: &str, table: &Table<'_>) -> u64 {
        let columns = table.with_time("time");
        let channels: Vec<u64> = columns.iter().enumerate().map(|(k, column)| self.channel(k, column)).collect();
        channels.windows(2).for_each(|pair| self.link(pair[0], 0, pair[1]));
        let text = self.text(b"TX", name);
        // Record number, rows, flags, separator, bytes of a record, bytes of invalidation bits.
        let mut data = vec![0; 32];
        data[8..16].copy_from_slice(&(table.time.len() as u64).to_le_bytes());
        data[24..28].copy_from_slice(&(8 * columns.len() as u32).to_le_bytes());
        let group = self.block(b"CG", &[0, channels[0], text, 0, 0, 0], &data);
        let mut records = Vec::with_capacity(8 * columns.len() * table.time.len());
        for row in 0..table.time.len() {
            records.extend(columns.iter().flat_map(|column| column.values[row].to_le_bytes()));
        }
        let records = self.block(b"DT", &[], &records);
        self.block(b"DG", &[0, group, records, 0], &[0; 8])
    }

    fn channel(&mut self, index: usize, column: &Column<'_>) -> u64 {
        let (name, unit) = (self.text(b"TX", column.name), self.text(b"TX", column.unit));
        let description = if column.description.is_empty() { 0 } else { self.text(b"TX", column.description) };
        // Kind (2: master), its quantity (1: time), doubles, bit offset, byte offset, bits; the rest is zero.
        let mut data = vec![0; 72];
        data[..4].copy_from_slice(if index == 0 { &[2, 1, 4, 0] } else { &[0, 0, 4, 0] });
        data[4..8].copy_from_slice(&(8 * index as u32).to_le_bytes());
        data[8..12].copy_from_slice(&64u32.to_le_bytes());
        self.block(b"CN", &[0, 0, name, 0, 0, 0, unit, description], &data)
    }
}
