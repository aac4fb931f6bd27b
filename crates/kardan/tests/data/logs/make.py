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
pq.write_table(table.select(["time", "ramp"]), "delta.parquet", use_dictionary=False, column_encoding={"time": "BYTE_STREAM_SPLIT", "ramp": "DELTA_BINARY_PACKED"})
