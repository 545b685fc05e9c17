//! From power-on to a stream: what to send, which sensor it is, which parser reads it, how its motor keeps its speed.

pub mod choice;
pub mod identify;
pub mod motor;
pub mod startup;
