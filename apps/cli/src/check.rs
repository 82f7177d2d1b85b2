//! `radiosity check`: what is in a scene, and every fault of it.

use crate::input::{self, SceneArguments};
use crate::{Failure, Global};
use clap::Args;
use radiosity::{Mesh, Scene};
use serde_json::{Value, json};
use std::collections::HashMap;

/// Arguments of `check`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
}

/// Runs the verb.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), Failure> {
    let mut input = input::read(&arguments.scene)?;
    let mesh = Mesh::new(&input.scene);
    let open = open_edges(&mesh);
    if open > 0 {
        input.faults.note(
            input.title.clone(),
            format!("{open} edges belong to one face only: surfaces are open there"),
            "harmless for rooms with openings; in a solid it lets light in",
        );
    }
    let triangles = 0..input.scene.triangles.len();
    let area: f64 = triangles.map(|t| input.scene.area(t)).sum();
    if global.json {
        println!("{}", describe(&input.title, &input.scene, area, open, &input.faults));
        return Ok(());
    }
    println!("{}", input.title);
    println!("  {} triangles in {} objects, {area} m²", input.scene.triangles.len(), input.scene.objects.len());
    if let Some([low, high]) = input.scene.bounding_box() {
        println!("  from {low} to {high} m");
    }
    let emitting = input.scene.materials.iter().filter(|m| m.emits()).count();
    println!("  {} materials, {emitting} of them emit", input.scene.materials.len());
    println!("  {} lights without area, {} cameras", input.scene.lights.len(), input.scene.cameras.len());
    for fault in &input.faults.0 {
        println!("{fault}");
    }
    if input.faults.0.is_empty() {
        println!("  no faults");
    }
    Ok(())
}

/// Edges of the welded mesh that only one face has.
fn open_edges(mesh: &Mesh) -> usize {
    let mut walked: HashMap<(u32, u32), u32> = HashMap::new();
    for corners in &mesh.triangles {
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            *walked.entry((a.min(b), a.max(b))).or_default() += 1;
        }
    }
    walked.values().filter(|n| **n == 1).count()
}

fn describe(title: &str, scene: &Scene, area: f64, open: usize, faults: &radiosity::Faults) -> Value {
    let bounds = scene.bounding_box().map(|b| b.map(|p| p.to_array()));
    let materials: Vec<Value> = scene
        .materials
        .iter()
        .map(|m| json!({ "name": m.name, "base_color": m.base_color, "emissive": m.emissive, "double_sided": m.double_sided }))
        .collect();
    let lights: Vec<Value> = scene
        .lights
        .iter()
        .map(|l| json!({ "name": l.name, "kind": format!("{:?}", l.kind), "intensity": l.intensity }))
        .collect();
    let cameras: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
    json!({
        "scene": title, "triangles": scene.triangles.len(), "area": area, "bounding_box": bounds,
        "objects": scene.objects.len(), "materials": materials, "lights": lights, "cameras": cameras,
        "open_edges": open, "faults": faults,
    })
}
