//! What a lit model cannot show of sheets that transmit light.
//!
//! Light is written as the irradiance E of each side, and viewers show base colour × E/π. A sheet sends (ρ E + τ E')/π, with
//! E' the irradiance of its other side: where base colour × E/π stands for that, light that comes through is missing.

use radiosity::{Fault, Scene, Severity, counted};

/// Names that are told; the others are counted.
const NAMED: usize = 5;

/// What a lit model does not show of the objects through which light passes, if there are any.
pub fn warning(scene: &Scene, title: &str) -> Option<Fault> {
    let transmits = |material: usize| scene.materials[material].transmits();
    let sheets: Vec<String> =
        scene.objects.iter().filter(|o| transmits(o.material)).map(|o| format!("'{}'", o.name)).collect();
    let named = sheets.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
    let others = match sheets.len() {
        0 => return None,
        n if n > NAMED => format!(" and {}", counted(n - NAMED, "other", "others")),
        _ => String::new(),
    };
    Some(Fault {
        severity: Severity::Warning,
        place: title.to_owned(),
        what: format!(
            "light passes through {named}{others}; each side is written with the light that falls on it, and viewers show \
             its reflection by the base colour, not what comes through"
        ),
        hint: "shade a side by (ρ E + τ E')/π with the light E' of the other side; --image and render do so".to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity::{Material, Transmission};

    #[test]
    fn sheets_are_named_and_many_are_counted() {
        let mut scene = Scene { materials: vec![Material::default(); 2], ..Scene::default() };
        let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]].map(Into::into);
        scene.add_triangles("wall", 0, &[corners]);
        assert_eq!(warning(&scene, "t"), None);
        scene.materials[1].transmission = Some(Transmission { transmittance: [0.0, 0.1, 0.0], ..Default::default() });
        for k in 0..7 {
            scene.add_triangles(&format!("leaf {k}"), 1, &[corners]);
        }
        let said = warning(&scene, "t.gltf").unwrap().to_string();
        assert!(said.starts_with("warning: t.gltf: light passes through 'leaf 0', "), "{said}");
        assert!(said.contains("'leaf 4' and 2 others;") && !said.contains("wall"), "{said}");
    }
}
