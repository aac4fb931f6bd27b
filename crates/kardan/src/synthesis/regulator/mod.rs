//! State feedback by pole placement and by quadratic cost, in floating point with certified residuals.
