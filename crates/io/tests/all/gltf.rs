//! What nodes, instances, skins and morph targets do to a triangle.

use glam::{DVec3, Vec3};
use radiosity_io::{LoadOptions, Loaded, Memory, gltf};
use radiosity_scene::{Material, Transmission};
use serde_json::{Value, json};

/// A triangle (0,0,0) (1,0,0) (0,1,0) facing +Z with normals, and further floats behind it, in `mesh.bin`.
struct File {
    floats: Vec<f32>,
    accessors: Vec<Value>,
    views: Vec<Value>,
}

impl File {
    fn new() -> File {
        let mut file = File { floats: Vec::new(), accessors: Vec::new(), views: Vec::new() };
        file.add("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        file.add("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        file
    }

    /// Adds an accessor of floats; returns its index.
    fn add(&mut self, kind: &str, floats: &[f32]) -> usize {
        let width = match kind {
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        self.views.push(json!({"buffer": 0, "byteOffset": 4 * self.floats.len(), "byteLength": 4 * floats.len()}));
        let view = self.views.len() - 1;
        self.accessors
            .push(json!({"bufferView": view, "componentType": 5126, "count": floats.len() / width, "type": kind}));
        self.floats.extend(floats);
        self.accessors.len() - 1
    }

    fn load(self, rest: Value) -> Result<Loaded, String> {
        self.load_with(rest, &LoadOptions::default())
    }

    fn load_with(self, rest: Value, options: &LoadOptions) -> Result<Loaded, String> {
        let bytes: Vec<u8> = self.floats.iter().flat_map(|f| f.to_le_bytes()).collect();
        let mut json = json!({
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": bytes.len(), "uri": "mesh.bin"}],
            "bufferViews": self.views,
            "accessors": self.accessors,
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0}}],
        });
        json.as_object_mut().unwrap().extend(rest.as_object().unwrap().clone());
        let source = Memory([("mesh.bin".to_owned(), bytes)].into());
        gltf::load("t.gltf", json.to_string().as_bytes(), &source, options).map_err(|e| e.to_string())
    }
}

fn front(loaded: &Loaded, triangle: usize) -> DVec3 {
    let [a, b, c] = loaded.scene.corners(triangle);
    (b - a).cross(c - a).normalize()
}

#[test]
fn a_mirrored_node_keeps_its_front() {
    for (scale, expected) in
        [([1, 1, 1], DVec3::Z), ([-2, 1, 1], DVec3::Z), ([1, 1, -1], -DVec3::Z), ([-1, -1, -1], -DVec3::Z)]
    {
        let loaded = File::new().load(json!({"nodes": [{"mesh": 0, "scale": scale}]})).unwrap();
        assert!((front(&loaded, 0) - expected).length() < 1e-12, "{scale:?}");
        assert!((loaded.scene.normals[0].as_dvec3() - expected).length() < 1e-6, "{scale:?}");
    }
}

#[test]
fn normals_follow_the_inverse_transpose() {
    // Squeezed along x, a plane at 45° tilts; its normal must stay perpendicular to it.
    let half = std::f64::consts::FRAC_PI_8;
    let loaded = File::new()
        .load(json!({"nodes": [{"scale": [0.25, 1, 1], "children": [1]},
            {"mesh": 0, "rotation": [0, half.sin(), 0, half.cos()]}], "scenes": [{"nodes": [0]}]}))
        .unwrap();
    assert!((loaded.scene.normals[0].as_dvec3() - front(&loaded, 0)).length() < 1e-6);
}

#[test]
fn one_mesh_in_several_places_is_several_objects() {
    let loaded = File::new()
        .load(json!({"nodes": [{"mesh": 0, "name": "left"}, {"mesh": 0, "translation": [5, 0, 0]}]}))
        .unwrap();
    let names: Vec<&str> = loaded.scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["left", "node 1"]);
    assert_eq!(loaded.scene.positions[3], DVec3::new(5.0, 0.0, 0.0));
}

#[test]
fn gpu_instances_are_objects_with_their_number() {
    let mut file = File::new();
    let translation = file.add("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 7.0]);
    let scale = file.add("VEC3", &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
    let extension = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": translation, "SCALE": scale}}});
    let loaded = file
        .load(json!({"nodes": [{"mesh": 0, "translation": [1, 0, 0], "extensions": extension}],
            "extensionsRequired": ["EXT_mesh_gpu_instancing"]}))
        .unwrap();
    assert_eq!(loaded.scene.objects.iter().map(|o| o.source.instance).collect::<Vec<_>>(), [0, 1]);
    assert_eq!(loaded.scene.positions[4], DVec3::new(3.0, 0.0, 7.0));
}

#[test]
fn morph_targets_have_their_default_weights() {
    let mut file = File::new();
    let target = file.add("VEC3", &[0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0]);
    let mesh = json!([{"weights": [0.25],
        "primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "material": 0, "targets": [{"POSITION": target}]}]}]);
    let loaded = file.load(json!({"meshes": mesh, "nodes": [{"mesh": 0}, {"mesh": 0, "weights": [1.0]}]})).unwrap();
    assert_eq!([loaded.scene.positions[0].z, loaded.scene.positions[3].z], [0.5, 2.0]);
}

#[test]
fn a_skinned_mesh_stands_where_its_joints_are() {
    let mut file = File::new();
    let inverse_bind: Vec<f32> = glam::Mat4::from_translation(Vec3::new(0.0, 0.0, -1.0)).to_cols_array().to_vec();
    let matrices = file.add("MAT4", &inverse_bind);
    let weights = file.add("VEC4", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    let joints = file.accessors.len();
    file.accessors.push(json!({"componentType": 5123, "count": 3, "type": "VEC4"}));
    let attributes = json!({"POSITION": 0, "NORMAL": 1, "JOINTS_0": joints, "WEIGHTS_0": weights});
    let loaded = file
        .load(json!({
            "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
            "skins": [{"joints": [1], "inverseBindMatrices": matrices}],
            "nodes": [{"mesh": 0, "skin": 0, "translation": [100, 0, 0]}, {"translation": [0, 3, 0]}]}))
        .unwrap();
    // Joint × inverse bind; the mesh's own node does not count.
    assert_eq!(loaded.scene.positions[0], DVec3::new(0.0, 3.0, -1.0));
    assert!(loaded.faults.to_string().contains("skinned"));
}

#[test]
fn faults_are_reported_together() {
    let rest = json!({"nodes": [{"mesh": 0, "translation": [1, 2]}, {"mesh": 4}, {"children": [9]}, {"mesh": 0, "rotation": [0, 0, 0, 0]}],
        "extensionsRequired": ["XX_a", "XX_b"]});
    let text = File::new().load(rest).unwrap_err();
    for expected in ["translation is a list of 2", "mesh 4 of 1", "'XX_a'", "'XX_b'", "node 9", "nodes[3]: rotation"] {
        assert!(text.contains(expected), "{text}");
    }
}

/// A few hundred bytes that place a triangle ten million times.
#[test]
fn instances_without_end_are_refused() {
    let mut file = File::new();
    file.accessors.push(json!({"componentType": 5126, "count": 1_000_000, "type": "VEC3"}));
    let instances = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}});
    let primitive = json!({"attributes": {"POSITION": 0}, "material": 0});
    let rest = json!({"meshes": [{"primitives": vec![primitive; 10]}],
        "nodes": [{"mesh": 0, "extensions": instances}]});
    let options = LoadOptions { max_triangles: 1_000_000, ..LoadOptions::default() };
    let text = file.load_with(rest, &options).unwrap_err();
    assert!(text.contains("larger than 1000000 triangles"), "{text}");
}

/// It was given the stand-in for primitives without material, which had been taken away again: out of bounds.
#[test]
fn a_material_that_does_not_exist_is_named() {
    let mesh = json!([{"primitives": [{"attributes": {"POSITION": 0}, "material": 7}]}]);
    let text = File::new().load(json!({"meshes": mesh, "nodes": [{"mesh": 0}]})).unwrap_err();
    assert!(text.contains("material 7 of 1"), "{text}");
}

/// Catalogue 90: what no surface is, is told with the object or material, all of it at once.
#[test]
fn catalogue_90_ranges_are_named_with_the_object() {
    let mut file = File::new();
    file.add("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    file.add("VEC3", &[f32::NAN, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let mesh = |position: usize, material: usize| json!({"primitives": [{"attributes": {"POSITION": position}, "material": material}]});
    let rest = json!({
        "meshes": [mesh(0, 0), mesh(2, 1), mesh(3, 2)],
        "nodes": [{"name": "wall", "mesh": 0}, {"name": "line", "mesh": 1}, {"name": "hole", "mesh": 2}],
        "materials": [
            {"name": "too white", "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [1.2, 0.5, 0.5, 1]}},
            {"name": "dark lamp", "emissiveFactor": [-1, 0, 0]},
            {"name": "odd lamp", "emissiveFactor": [1, 1, 1],
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": -5}}},
        ],
    });
    let loaded = File::load(file, rest).unwrap();
    let said = loaded.faults.to_string();
    for (name, what) in [
        ("object 'line'", "no area"),
        ("object 'hole'", "not finite"),
        ("too white", "clamped to 0..1"),
        ("dark lamp", "clamped to 0..1"),
        ("odd lamp", "emissiveStrength is -5"),
    ] {
        assert!(said.lines().any(|line| line.contains(name) && line.contains(what)), "{name}: {what}\n{said}");
    }
    assert!(!loaded.scene.validate("t").has_errors());
    // A scene made by hand is not mended but refused.
    let mut scene = loaded.scene;
    scene.materials[0].base_color[0] = 1.2;
    scene.materials[1].emissive[0] = f32::NAN;
    let transmission = Transmission { transmittance: [0.1, 0.6, 0.1], ..Transmission::default() };
    scene.materials[2] =
        Material { name: "opal".into(), base_color: [0.5; 4], transmission: Some(transmission), ..Material::default() };
    scene.positions[0].x = f64::NAN;
    let said = scene.validate("t").to_string();
    for what in ["base colour", "emission", "material 'opal': reflectance and transmittance sum to [0.6, 1.1, 0.6]"] {
        assert!(said.contains(what), "{what}\n{said}");
    }
    assert!(scene.validate("t").has_errors());
}
