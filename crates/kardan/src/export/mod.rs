//! Export: bytes from results; nothing is computed here.
