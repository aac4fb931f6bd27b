//! Report: one self-contained HTML file and SVG plots from results; nothing is computed here.
