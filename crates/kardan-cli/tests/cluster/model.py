#!/usr/bin/env python3
"""How a sweep scales beyond the machines at hand: shards in the order of their numbers to the first free cores, with measured costs.

A shard of n samples holds `threads` cores for `start + n * sample / threads * spread`; a scheduler hands out one shard after the other, `dispatch` each.
At the end one process merges, `merge` for each row. Up to 10^7 samples are one sweep, of 1000 shards at most; more are sweeps of other seeds, whose
shards stand in the same queue and whose merges run one after the other. Efficiency: the time of all samples on the cores, over what it takes; without the merge,
and with it.
"""
import heapq
import random

SAMPLE = 0.76e-3  # s of a core for a sample: 40 shards of 1000 samples, `throughput.sh`
START = 0.012  # s of a shard beside its samples: process, model, pages
DISPATCH = 0.9e-3  # s of the scheduler for a task: 1000 empty tasks of HyperQueue on two workers
MERGE = 4.0e-6  # s of the merge for a row
SPREAD = 0.1  # shards take up to so much longer than their samples, evenly


def simulate(samples, cores):
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
        over = begin + START + of_sweep / shards * SAMPLE / threads * (1 + SPREAD * chance.random())
        heapq.heappush(free, over)
        end = max(end, over)
    ideal = samples * SAMPLE / cores
    return shards * sweeps, threads, end, samples * MERGE, ideal / end, ideal / (end + samples * MERGE)


def told(seconds):
    for unit, size in (("d", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


if __name__ == "__main__":
    print("| samples | cores | shards × threads | shards take | merge | efficiency | with the merge |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for power in range(6, 10):
        for cores in (10, 100, 1000, 10000):
            shards, threads, end, merge, alone, whole = simulate(10**power, cores)
            row = (f"10^{power}", cores, f"{shards} × {threads}", told(end), told(merge), f"{alone:.0%}", f"{whole:.0%}")
            print("| " + " | ".join(map(str, row)) + " |")
