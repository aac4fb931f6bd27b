"""Writes the files of this folder: see README.md. Needs asammdf, pyarrow, scipy and numpy."""

import struct

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from asammdf import MDF, Signal
from scipy.io import savemat

N = 100
k = np.arange(N)
time = k * 0.01
sine = np.sin(k / 10)
ramp = (k - 50).astype("<i2")


def mdf_signals(t):
    n = len(t)
    j = np.arange(n)
    linear = {"a": 0.5, "b": -10.0}  # physical = 0.5 raw - 10
    return [
        Signal(np.sin(j / 10), t, name="sine", unit="rad"),
        Signal((j - 50).astype("<i2"), t, name="ramp", unit="N m"),
        Signal((j % 256).astype("<u1"), t, name="scaled", unit="A", conversion=linear),
        Signal((0.25 * j).astype("<f4"), t, name="single", unit="V"),
    ]


def mdf(name, compression=0, slow=True, **options):
    file = MDF(version="4.10")
    file.append(mdf_signals(time), acq_name="fast")
    if slow:
        t = np.arange(10) * 0.1
        file.append([Signal(2.0 * np.arange(10), t, name="slow", unit="degC")], acq_name="slow")
    file.save(name, compression=compression, overwrite=True)
    file.close()


mdf("rasters.mf4")
mdf("deflated.mf4", compression=1, slow=False)
mdf("transposed.mf4", compression=2, slow=False)

file = MDF(version="4.10")
invalid = k % 5 == 0
file.append([
    Signal(sine, time, name="holes", unit="V", invalidation_bits=invalid),
    Signal((k - 50).astype(">i4"), time, name="big", unit="1"),
    Signal((0.5 * k).astype(">f8"), time, name="big_float", unit="1"),
    Signal(k.astype("<u1"), time, name="table", conversion={"raw_0": 0.0, "phys_0": 0.0, "raw_1": 50.0, "phys_1": 100.0, "raw_2": 100.0, "phys_2": 0.0, "interpolation": True}),
    Signal(k.astype("<u1"), time, name="rational", conversion={"P1": 0, "P2": 1, "P3": 0, "P4": 0, "P5": 0.5, "P6": 1}),
    Signal(k.astype("<f8"), time, name="sine"),
    Signal(-k.astype("<f8"), time, name="sine"),
], acq_name="odd")
file.save("odd.mf4", overwrite=True)
file.close()

# SciPy
savemat("matrix.mat", {"data": np.stack([time, sine, k], axis=1), "J": 1.2e-4, "note": "text"})
savemat("vectors.mat", {"time": time, "sine": sine, "ramp": ramp, "slow": np.arange(10.0), "single": (0.25 * k).astype("f4")}, do_compression=True)
savemat("columns.mat", {"time": time, "sine": sine, "ramp": ramp}, oned_as="column")
savemat("rows.mat", {"log": np.stack([time, sine])}, do_compression=True)
savemat(
    "simulink.mat",
    {"logsout": {"time": time, "signals": {"values": np.stack([sine, 2.0 * k], axis=1), "label": "speed", "dimensions": 2.0}}},
    do_compression=True,
)
x = np.zeros(1, dtype=[("Name", "O"), ("Data", "O"), ("Unit", "O"), ("Raster", "O")])
x[0] = ("time", time, "s", "1ms")
y = np.zeros(2, dtype=[("Name", "O"), ("Data", "O"), ("Unit", "O"), ("Raster", "O")])
y[0] = ("Model/Speed", sine, "rad/s", "1ms")
y[1] = ("Model/Torque", ramp, "N m", "1ms")
savemat("control_desk.mat", {"capture": {"X": x, "Y": y}})

# pyarrow
table = pa.table({"time": time, "sine": sine, "ramp": ramp, "single": (0.25 * k).astype("f4"), "flag": k % 2 == 0, "word": ["x"] * N})
pq.write_table(table, "snappy.parquet")
pq.write_table(table, "plain.parquet", compression="NONE", use_dictionary=False)
pq.write_table(table, "gzip.parquet", compression="GZIP")
pq.write_table(table, "zstd.parquet", compression="ZSTD", data_page_version="2.0")
holes = pa.array([None if j % 5 == 0 else float(np.sin(j / 10)) for j in range(N)])
stamps = {unit: pa.array([j * 10 * 10 ** (p - 3) for j in range(N)], pa.timestamp(unit)) for unit, p in (("ms", 3), ("us", 6), ("ns", 9))}
schema = pa.schema([
    pa.field("stamp", pa.timestamp("ms")),
    pa.field("us", pa.timestamp("us")),
    pa.field("ns", pa.timestamp("ns")),
    pa.field("holes", pa.float64(), metadata={"unit": "rad"}),
    pa.field("u64", pa.uint64()),
    pa.field("none", pa.float64()),
])
columns = [stamps["ms"], stamps["us"], stamps["ns"], holes, pa.array([2**63 + 2048 * j for j in range(N)], pa.uint64()), pa.nulls(N, pa.float64())]
pq.write_table(pa.table(columns, schema=schema), "nulls.parquet", row_group_size=40)
elapsed = {unit: pa.array([j * each for j in range(N)], pa.duration(unit)) for unit, each in (("s", 1), ("ms", 10), ("us", 10_000), ("ns", 10_000_000))}
pq.write_table(pa.table({"run": elapsed["ms"], "s": elapsed["s"], "us": elapsed["us"], "ns": elapsed["ns"], "ramp": ramp}), "duration.parquet")
pq.write_table(pa.table({"old": stamps["ns"], "ramp": ramp}), "int96.parquet", use_deprecated_int96_timestamps=True)
pq.write_table(table.select(["time", "ramp"]), "delta.parquet", use_dictionary=False, column_encoding={"time": "BYTE_STREAM_SPLIT", "ramp": "DELTA_BINARY_PACKED"})


# No tool at hand writes unsorted or unfinished MDF files, so these are put together from the standard; asammdf reads
# the first one below and must find the same values.
def unsorted(name, finished):
    out = bytearray(64)
    out[0:24] = (b"MDF     " if finished else b"UnFinMF ") + b"4.10    make.py "
    struct.pack_into("<H", out, 28, 410)
    if not finished:
        struct.pack_into("<HH", out, 60, 0b101, 0)  # rows and length of the last block are not known

    def block(kind, links, data):
        out.extend(bytes(-len(out) % 8))
        at = len(out)
        out.extend(b"##" + kind + bytes(4) + struct.pack("<QQ", 24 + 8 * len(links) + len(data), len(links)))
        out.extend(struct.pack(f"<{len(links)}Q", *links) + data)
        return at

    def text(words):
        raw = words.encode() + b"\0"
        return block(b"TX", [], raw + bytes(-len(raw) % 8))

    def channel(after, name, kind, data_type, bit, byte, bits):
        data = struct.pack("<BBBBIIIIBBH6d", kind, 1 if kind == 2 else 0, data_type, bit, byte, bits, 0, 0, 0, 0, 0, *[0] * 6)
        return block(b"CN", [after, 0, text(name), 0, 0, 0, text("s" if kind == 2 else "1"), 0], data)

    block(b"HD", [0] * 6, bytes(32))
    history = block(b"FH", [0, block(b"MD", [], b"<FHcomment><TX>x</TX></FHcomment>\0\0\0\0\0\0\0")], bytes(16))
    struct.pack_into("<Q", out, 64 + 24 + 8, history)
    # group 1: time double, big-endian int16, three bits inside a byte; group 2: time double, big-endian single
    first = channel(0, "bits", 0, 0, 2, 10, 3)
    first = channel(first, "word", 0, 3, 0, 8, 16)
    first = channel(first, "t", 2, 4, 0, 0, 64)
    second = channel(0, "single", 0, 5, 0, 8, 32)
    second = channel(second, "t", 2, 4, 0, 0, 64)
    group = lambda after, channels, number, rows, size: block(b"CG", [after, channels, 0, 0, 0, 0], struct.pack("<QQHHIII", number, rows if finished else 0, 0, 0, 0, size, 0))
    groups = group(0, second, 2, 20, 12)
    groups = group(groups, first, 1, 60, 11)
    data = bytearray()
    for j in range(60):
        data += b"\x01" + struct.pack("<d", 0.5 * j) + struct.pack(">h", 1000 - j) + bytes([0b11100011 & ~0b11100 | (j % 8) << 2])
        if j % 3 == 0:
            data += b"\x02" + struct.pack("<d", 0.5 * j) + struct.pack(">f", -(j // 3))
    if not finished:
        data += b"\x01\x00\x00"  # the recorder stopped here
    dg = block(b"DG", [0, groups, 0, 0], bytes([1]) + bytes(7))
    dt = block(b"DT", [], bytes(data))
    struct.pack_into("<Q", out, dg + 40, dt)
    struct.pack_into("<Q", out, 64 + 24, dg)
    if not finished:
        struct.pack_into("<Q", out, dt + 8, 24)
    open(name, "wb").write(out)


unsorted("unsorted.mf4", True)
unsorted("unfinished.mf4", False)
with MDF("unsorted.mf4") as file:
    assert np.array_equal(file.get("word").samples, 1000 - np.arange(60)), file.get("word").samples
    assert np.array_equal(file.get("bits").samples, np.arange(60) % 8)
    assert np.array_equal(file.get("single").samples, -np.arange(20.0))
