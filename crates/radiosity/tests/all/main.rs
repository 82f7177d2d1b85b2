//! All tests from outside in one program: one to compile and to link.

mod beams;
#[path = "../common/bits.rs"]
mod bits;
mod curved;
mod emitters;
mod exchange;
#[path = "../common/finish.rs"]
mod finish;
#[path = "../common/full.rs"]
mod full;
#[path = "../common/furnace.rs"]
mod furnace;
#[path = "../common/furnished.rs"]
mod furnished;
mod gathers;
mod lamps;
mod layers;
mod live;
mod narrow;
mod openings;
mod paint;
mod planes;
mod refusals;
#[path = "../common/room.rs"]
mod room;
mod sites;
#[path = "../common/small.rs"]
mod small;
mod stopping;
mod surveys;
mod truths;
mod written;
