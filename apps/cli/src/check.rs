//! `radiosity check`: what is in a scene, and every fault of it.

mod flipped;
mod overlap;

use crate::input::{self, Input, SceneArguments};
use crate::output::print;
use crate::{Failure, Global};
use clap::Args;
use radiosity::{Mesh, PointLightKind};
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
    warn_of_flipped_faces(&mut input, &mesh);
    warn_of_overlaps(&mut input, &mesh);
    if global.json { print(&describe(&input, open).to_string()) } else { print(&summary(&input)) }
}

fn warn_of_flipped_faces(input: &mut Input, mesh: &Mesh) {
    for (object, count) in flipped::edges(&input.scene, mesh) {
        let edges = if count == 1 { "1 edge lies" } else { &format!("{count} edges lie") };
        input.faults.warning(
            format!("{}: object '{}'", input.title, input.scene.objects[object].name),
            format!("{edges} between faces that look opposite ways: one shows its black back beside the other's front"),
            "turn the faces that look the wrong way ('recalculate normals'), or make the material two-sided",
        );
    }
}

fn warn_of_overlaps(input: &mut Input, mesh: &Mesh) {
    let found = overlap::search(&input.scene, mesh);
    let name = |object: usize| &input.scene.objects[object].name;
    for (&object, &(count, on)) in &found.objects {
        input.faults.warning(
            format!("{}: object '{}'", input.title, name(object)),
            format!("{count} triangles lie in one plane with object '{}', overlap it and face the same way", name(on)),
            "which of the two is seen is chance: move one of them by a millimetre, or remove what is covered",
        );
    }
    if found.more {
        let what = "too many triangles lie in one place; overlapping surfaces were not all searched for";
        input.faults.note(input.title.clone(), what, "");
    }
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

fn area(input: &Input) -> f64 {
    (0..input.scene.triangles.len()).map(|t| input.scene.area(t)).sum()
}

fn summary(input: &Input) -> String {
    let scene = &input.scene;
    let count = |n: usize, noun: &str| format!("{n} {noun}{}", if n == 1 { "" } else { "s" });
    let mut lines = vec![input.title.clone()];
    let (triangles, objects) = (count(scene.triangles.len(), "triangle"), count(scene.objects.len(), "object"));
    lines.push(format!("  {triangles} in {objects}, {:.6} m²", area(input)));
    if let Some([low, high]) = scene.bounding_box() {
        let size = high - low;
        lines.push(format!("  {:.4} x {:.4} x {:.4} m, from {low:.4} to {high:.4}", size.x, size.y, size.z));
    }
    let emitting = scene.materials.iter().filter(|m| m.emits()).count();
    lines.push(format!("  {}, {emitting} of them luminous", count(scene.materials.len(), "material")));
    let (lights, cameras) = (count(scene.lights.len(), "light"), count(scene.cameras.len(), "camera"));
    lines.push(format!("  {lights} without area, {cameras}"));
    lines.extend(input.faults.0.iter().map(ToString::to_string));
    if input.faults.0.is_empty() {
        lines.push("  no faults".to_owned());
    }
    lines.join("\n")
}

fn describe(input: &Input, open: usize) -> Value {
    let scene = &input.scene;
    let bounds = scene.bounding_box().map(|b| b.map(|p| p.to_array()));
    let materials: Vec<Value> = scene
        .materials
        .iter()
        .map(|m| json!({ "name": m.name, "base_color": m.base_color, "emissive": m.emissive, "double_sided": m.double_sided }))
        .collect();
    let lights: Vec<Value> = scene
        .lights
        .iter()
        .map(|l| {
            let (kind, unit) = match l.kind {
                PointLightKind::Point => ("point", "cd"),
                PointLightKind::Spot { .. } => ("spot", "cd"),
                PointLightKind::Directional => ("directional", "lx"),
            };
            let (position, direction) = (l.position.to_array(), l.direction.to_array());
            let mut light = json!({
                "name": l.name, "kind": kind, "intensity": l.intensity, "unit": unit,
                "position": position, "direction": direction, "range": l.range,
            });
            if let PointLightKind::Spot { inner, outer } = l.kind {
                light["half_angles"] = json!([inner, outer]);
            }
            light
        })
        .collect();
    let cameras: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
    json!({
        "event": "result", "scene": input.title, "triangles": scene.triangles.len(), "area": area(input),
        "bounding_box": bounds, "objects": scene.objects.len(), "materials": materials, "lights": lights,
        "cameras": cameras, "open_edges": open, "faults": input.faults,
    })
}
