//! Pages of results: of real ones, and of ones made by hand that show what real ones rarely do.

mod colours;
mod drawing;
mod examples;
mod found;
mod rendered;
