#![no_std]
//! Controller blocks.
