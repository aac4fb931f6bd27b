//! Model file text to a document of typed tables.
