//! Decoupling by static state feedback after Gilbert, exact: relative degrees, decoupling matrix, canonical form,
//! compensation, transfer matrix \[diss. 6.2.2\].
