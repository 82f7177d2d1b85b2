//! The Cornell box with a lightmap: `cargo run --release -p radiosity --example bake -- cornell-lit.glb`.

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use radiosity::io::gltf_out::{Encoding, PageImage, Style, write_lit};
use radiosity::io::image_out::encode_png;
use radiosity::view::picture::srgb;
use radiosity::{BakeOptions, Mesh, Tracer, bake, cornell_box, lightmap};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args_os().nth(1).unwrap_or("cornell-lit.glb".into());
    let scene = cornell_box();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let baked = bake(&tracer, &BakeOptions { error: 0.02, ..BakeOptions::default() }, &())?;
    let map = lightmap(&baked, None, 4096, &())?;

    // Pages of 8 bits: irradiance as a share of the page's brightest texel.
    let mut pages = Vec::new();
    for ([width, height], lux) in map.pages.iter().zip(&map.irradiance) {
        let brightest = lux.iter().flatten().fold(f32::MIN_POSITIVE, |most, e| most.max(*e));
        let texels: Vec<[u8; 3]> = lux.iter().map(|e| e.map(|e| (255.0 * srgb(e / brightest)).round() as u8)).collect();
        pages.push(PageImage { png: encode_png(*width, *height, &texels)?, intensity: brightest });
    }
    let style = Style::Lightmap { pages, encoding: Encoding::Srgb, exposure: 1.0 };
    write_lit(&scene, None, &map.primitives, &style, path.as_ref())?;
    println!("{}: error at most {:.2} %", path.display(), 100.0 * baked.audit.upper);
    Ok(())
}
