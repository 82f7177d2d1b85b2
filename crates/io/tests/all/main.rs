//! All tests from outside in one program: one to compile and to link.

mod bad_inputs;
mod gltf;
mod hostile;
mod scenes;
mod vs3;
