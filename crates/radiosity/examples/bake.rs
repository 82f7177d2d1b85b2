//! The Cornell box with a lightmap: `cargo run --release -p radiosity --example bake -- cornell-lit.glb`. Without a name
//! it is written where temporary files are.

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use radiosity::io::gltf_out::{Encoding, Style, write_lit};
use radiosity::{BakeOptions, Mesh, Tracer, bake, cornell_box, lightmap};
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args_os().nth(1).map_or_else(|| std::env::temp_dir().join("cornell-lit.glb"), PathBuf::from);
    let scene = cornell_box();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let baked = bake(&tracer, &BakeOptions { error: 0.02, ..BakeOptions::default() }, &())?;
    let map = lightmap(&baked, None, 4096, &())?;

    let style = Style::Lightmap { pages: map.images(Encoding::Srgb)?, encoding: Encoding::Srgb, exposure: 1.0 };
    write_lit(&scene, None, &map.primitives, &style, &path)?;
    println!("wrote {}: error at most {:.2} %", path.display(), 100.0 * map.audit.upper);
    Ok(())
}
