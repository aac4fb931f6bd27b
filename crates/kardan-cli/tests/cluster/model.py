#!/usr/bin/env python3
"""How a sweep scales beyond the machines at hand: shards in the order of their numbers to the first free cores, with measured costs.

A shard of n samples holds `threads` cores for `start + n * sample / threads * spread`; a scheduler hands out one shard after the other, `dispatch` each.
At the end one process merges, `merge` for each row. Up to 10^7 samples are one sweep, of 1000 shards at most; more are sweeps of other seeds, whose
shards stand in the same queue and whose merges run one after the other. Efficiency: the time of all samples on the cores, over what it takes; without the merge,
and with it.
"""
import heapq
import random

SAMPLES = (0.75e-3, 0.5)  # s of a core for a sample: a shaft with a motor, `throughput.sh`; a car with steering and control (built-in `afs-steering`)
START = 0.02  # s of a shard beside its samples: process, model, pages
DISPATCH = 2.0e-3  # s of the scheduler for a task: 1000 empty tasks of HyperQueue on two workers
MERGE = 24e-6  # s of the merge for a row of 30 numbers, 200 000 rows
SPREAD = 0.1  # shards take up to so much longer than their samples, evenly


def simulate(samples, cores, sample):
    sweeps = max(1, samples // 10**7)
    of_sweep = samples // sweeps
    shards = min(1000, max(1, of_sweep // 1000))
    threads = max(1, cores // (shards * sweeps))
    free = [0.0] * max(1, cores // threads)
    heapq.heapify(free)
    chance = random.Random(1)
    end = 0.0
    for k in range(shards * sweeps):
        begin = max(heapq.heappop(free), (k + 1) * DISPATCH)
        over = begin + START + of_sweep / shards * sample / threads * (1 + SPREAD * chance.random())
        heapq.heappush(free, over)
        end = max(end, over)
    ideal = samples * sample / cores
    return end, ideal / end, ideal / (end + samples * MERGE)


def told(seconds):
    for unit, size in (("d", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


if __name__ == "__main__":
    titles = [f"{sample:g} s a sample: {what}" for sample in SAMPLES for what in ("shards take", "efficiency", "with the merge")]
    print("| samples | cores | merge | " + " | ".join(titles) + " |")
    print("| --- | --- | --- |" + " --- |" * len(titles))
    for power in range(6, 10):
        for cores in (10, 100, 1000, 10000):
            row = [f"10^{power}", str(cores), told(10**power * MERGE)]
            for sample in SAMPLES:
                end, alone, whole = simulate(10**power, cores, sample)
                row += [told(end), f"{alone:.0%}", f"{whole:.0%}"]
            print("| " + " | ".join(row) + " |")
