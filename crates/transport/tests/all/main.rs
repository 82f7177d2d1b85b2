//! All tests from outside but `growth` in one program: one to compile and to link.

#[path = "../rooms/building.rs"]
mod building;
mod enclosures;
mod every_method;
mod reference_run;
mod regions;
#[path = "../rooms/mod.rs"]
mod rooms;
mod spectra;
mod view_factors_planar;
mod view_factors_shapes;
