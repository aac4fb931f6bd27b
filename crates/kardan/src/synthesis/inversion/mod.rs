//! What static feedback cannot do: dynamic extension, blocks, the proof that outputs depend on each other, flatness. Exact.
