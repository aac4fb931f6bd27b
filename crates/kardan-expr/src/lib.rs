//! Exact expressions and their plans: one graph in which equal expressions are one node, differentiated exactly and compiled to a list
//! of operations.
//!
//! It knows dimensions, not what a symbol stands for. Begin with [`expr::Graph`], [`expr::Expr`] and [`plan::Plan`].
//!
//! ```
//! use kardan_expr::expr::Graph;
//! use kardan_math::units::Dimension;
//!
//! let mut graph = Graph::default();
//! let x = graph.symbol("x", Dimension::NONE);
//! let square = graph.multiply(x, x);
//! let slope = graph.derivative(square, graph.symbol_of(x).unwrap());
//! assert_eq!(slope, graph.scale(2.into(), x));
//! ```
#![deny(clippy::disallowed_methods)]

pub mod expr;
pub mod plan;
