"""What scripts/perf measures: every figure a ratio or a time, taken in one process, interleaved."""
