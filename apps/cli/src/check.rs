//! `radiosity check`: what is in a scene, and every fault of it.

use crate::input::{self, Input, SceneArguments};
use crate::numbers::place;
use crate::output::print;
use crate::{Failure, Global, faults};
use clap::Args;
use radiosity::{Material, PointLightKind, Severity, counted, listed};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Arguments of `check`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
}

/// Runs the verb.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), Failure> {
    let input = input::read(&arguments.scene)?;
    if global.json {
        print(&describe(&input).to_string())
    } else if global.quiet {
        let warnings = input.faults.0.iter().filter(|fault| fault.severity == Severity::Warning);
        warnings.map(ToString::to_string).try_for_each(|warning| print(&warning))
    } else {
        print(&summary(&input))
    }
}

fn area(input: &Input) -> f64 {
    (0..input.scene.triangles.len()).map(|t| input.scene.area(t)).sum()
}

fn summary(input: &Input) -> String {
    let scene = &input.scene;
    let count = |n: usize, noun: &str| counted(n, noun, &format!("{noun}s"));
    let mut lines = vec![input.title.clone()];
    let (triangles, objects) = (count(scene.triangles.len(), "triangle"), count(scene.objects.len(), "object"));
    lines.push(format!("  {triangles} in {objects}, {:.6} m²", area(input)));
    if let Some([low, high]) = scene.bounding_box() {
        let size = high - low;
        lines.push(format!(
            "  {:.4} x {:.4} x {:.4} m, from {} to {}",
            size.x,
            size.y,
            size.z,
            place(low.to_array()),
            place(high.to_array())
        ));
    }
    let used: BTreeSet<usize> = scene.objects.iter().map(|object| object.material).collect();
    let of_used = |is: fn(&Material) -> bool| used.iter().filter(|k| is(&scene.materials[**k])).count();
    let also = |n: usize, what: &str| if n > 0 { format!(", {n} {what}") } else { String::new() };
    let unused: Vec<usize> = (0..scene.materials.len()).filter(|k| !used.contains(k)).collect();
    let name = |k: &usize| match scene.materials[*k].name.as_str() {
        "" => format!("material {}", k + 1),
        name => format!("'{name}'"),
    };
    lines.push(format!(
        "  {}, {} of them luminous{}{}",
        count(scene.materials.len(), "material"),
        of_used(Material::emits),
        also(of_used(Material::transmits), "letting light through"),
        also(unused.len(), &format!("on no surface ({})", listed(unused.iter().map(name))))
    ));
    let (lights, cameras) = (count(scene.lights.len(), "light"), count(scene.cameras.len(), "camera"));
    lines.push(format!("  {lights} without area, {cameras}"));
    lines.extend(input.faults.0.iter().map(ToString::to_string));
    if input.faults.0.is_empty() {
        lines.push("  no faults".to_owned());
    }
    lines.join("\n")
}

fn describe(input: &Input) -> Value {
    let scene = &input.scene;
    let bounds = scene.bounding_box().map(|b| b.map(|p| p.to_array()));
    let materials: Vec<Value> = scene
        .materials
        .iter()
        .map(|m| {
            let mut json = json!({
                "name": m.name, "base_color": m.base_color, "emissive": m.emissive, "double_sided": m.double_sided
            });
            if let Some(transmission) = &m.transmission {
                json["transmittance"] = json!(transmission.transmittance);
            }
            json
        })
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
        "cameras": cameras, "open_edges": faults::open_edges(&input.mesh.sides_of_edges()), "faults": input.faults,
    })
}
