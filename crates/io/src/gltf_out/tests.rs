use super::*;
use crate::{LoadOptions, Memory, gltf};
use glam::{DVec3, Vec2, Vec3};
use radiosity_scene::{Material, Transmission, Up};
use serde_json::{Value, json};

/// Bytes of the attributes and an index list for one square: positions, normals, joints, weights, matrices.
fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A unit square in the plane z = 0 on five nodes: plain, mirrored, twice instanced, skinned, and bent by a morph
/// target; an accessor that nobody uses; extras and an unknown extension.
fn source() -> Value {
    let corners = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];
    let parts: Vec<Vec<u8>> = vec![
        floats(&corners),
        floats(&[0., 0., 1.].repeat(4)),
        vec![0, 0, 1, 0, 2, 0, 0, 0, 2, 0, 3, 0],
        floats(&[1., 0.5, 0.25].repeat(4)),
        [[0_u8, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]].concat(),
        floats(&[1., 0., 0., 0.].repeat(4)),
        floats(&[0., 0., 0., 0., 0., 0., 0., 0., 1., 0., 0., 1.]),
        floats(&[3., 0., 0., 6., 0., 0.]),
        floats(&[1., 1., 1., 1., -1., 1.]),
        floats(&[9.0; 500]),
    ];
    let mut bytes = Vec::new();
    let mut views = Vec::new();
    for part in &parts {
        views.push(json!({ "buffer": 0, "byteOffset": bytes.len(), "byteLength": part.len() }));
        bytes.extend(part);
    }
    let accessor = |view: usize, component: u32, count: u32, kind: &str| json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
    let mut position = accessor(0, 5126, 4, "VEC3");
    position["min"] = json!([0, 0, 0]);
    position["max"] = json!([1, 1, 0]);
    let mut moved = accessor(6, 5126, 4, "VEC3");
    moved["min"] = json!([0, 0, 0]);
    moved["max"] = json!([0, 0, 1]);
    let primitive = json!({ "attributes": { "POSITION": 0, "NORMAL": 1, "COLOR_0": 3 }, "indices": 2, "material": 0,
        "extras": { "kept": "part" } });
    let mut skinned = primitive.clone();
    skinned["attributes"]["JOINTS_0"] = 4.into();
    skinned["attributes"]["WEIGHTS_0"] = 5.into();
    let mut morphed = primitive.clone();
    morphed["targets"] = json!([{ "POSITION": 6 }]);
    let data: String = {
        use base64::Engine;
        base64::engine::general_purpose::STANDARD.encode(&bytes)
    };
    json!({
        "asset": { "version": "2.0", "generator": "somebody", "copyright": "kept" },
        "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "extensionsRequired": ["EXT_mesh_gpu_instancing"],
        "scene": 0,
        "scenes": [{ "nodes": [0, 1, 2, 3, 4] }],
        "nodes": [
            { "mesh": 0, "name": "plain", "extras": { "kept": 1 } },
            { "mesh": 0, "name": "mirrored", "scale": [-1, 1, 1], "translation": [0, 5, 0] },
            { "mesh": 0, "name": "many", "translation": [0, 0, 7],
              "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 7, "SCALE": 8 } } } },
            { "mesh": 1, "name": "bent", "skin": 0, "children": [5, 6] },
            { "mesh": 2, "name": "morphed", "translation": [0, -5, 0] },
            { "name": "a" }, { "name": "b", "translation": [0, 0, 2] },
        ],
        "skins": [{ "joints": [5, 6] }],
        "meshes": [
            { "primitives": [primitive], "name": "square" },
            { "primitives": [skinned] },
            { "primitives": [morphed], "weights": [0.5] },
        ],
        "materials": [{ "name": "paint", "extras": { "kept": 2 },
            "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0 } }],
        "accessors": [
            position, accessor(1, 5126, 4, "VEC3"), accessor(2, 5123, 6, "SCALAR"), accessor(3, 5126, 4, "VEC3"),
            accessor(4, 5121, 4, "VEC4"), accessor(5, 5126, 4, "VEC4"), moved, accessor(7, 5126, 2, "VEC3"),
            accessor(8, 5126, 2, "VEC3"), accessor(9, 5126, 500, "SCALAR"),
        ],
        "bufferViews": views,
        "buffers": [{ "byteLength": bytes.len(), "uri": format!("data:application/octet-stream;base64,{data}") }],
        "extras": { "bufferView": 3, "kept": "all" },
    })
}

fn load(bytes: &[u8]) -> crate::Loaded {
    gltf::load("t.gltf", bytes, &Memory::default(), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Every triangle cut in two at the middle of its first side, with light of the given kind.
fn halved(scene: &Scene, light: impl Fn(&[DVec3]) -> Light) -> Vec<LitPrimitive> {
    let cut = |index: usize| {
        let object = &scene.objects[index];
        let first = object.vertices.start as u32;
        let (mut vertices, mut triangles, mut points) = (Vec::new(), Vec::new(), Vec::new());
        for t in object.triangles.clone() {
            let [a, b, c] = scene.triangles[t].map(|v| v - first);
            let base = vertices.len() as u32;
            for corner in [a, b, c] {
                vertices.push(LitVertex { corners: [corner; 3], weights: [1.0, 0.0, 0.0] });
            }
            vertices.push(LitVertex { corners: [a, b, c], weights: [0.5, 0.5, 0.0] });
            triangles.extend([[base, base + 3, base + 2], [base + 3, base + 1, base + 2]]);
            let [p, q, r] = scene.corners(t);
            points.extend([p, q, r, 0.5 * (p + q)]);
        }
        LitPrimitive { object: index, vertices, triangles, flipped: false, light: light(&points) }
    };
    (0..scene.objects.len()).map(cut).collect()
}

/// A value that tells places apart: lx by world position.
fn field(p: DVec3) -> Bands {
    [(100.0 + 10.0 * p.x) as f32, (50.0 + p.y) as f32, (20.0 + p.z) as f32]
}

fn at_vertices(points: &[DVec3]) -> Light {
    Light::Vertex { irradiance: points.iter().map(|&p| field(p)).collect() }
}

fn on_page(points: &[DVec3]) -> Light {
    Light::Lightmap { page: 0, uv: vec![[0.25, 0.75]; points.len()] }
}

fn pages() -> Vec<PageImage> {
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(4, 4, image::Rgb([255; 3])).write_to(&mut png, image::ImageFormat::Png).unwrap();
    vec![PageImage { png: png.into_inner(), intensity: 200.0 }]
}

fn vector_area(scene: &Scene, object: usize) -> DVec3 {
    let cross = |t: usize| {
        let [a, b, c] = scene.corners(t);
        0.5 * (b - a).cross(c - a)
    };
    scene.objects[object].triangles.clone().map(cross).sum()
}

#[test]
fn every_kind_of_node_stands_where_it_stood_and_faces_as_it_faced() {
    let before = load(source().to_string().as_bytes());
    assert_eq!(before.scene.objects.len(), 6);
    for (style, light) in [
        (Style::Vertices, at_vertices as fn(&[DVec3]) -> Light),
        (Style::Unlit { exposure: 0.01 }, at_vertices),
        (Style::Lightmap { pages: pages(), encoding: Encoding::Srgb, exposure: 1.0 }, on_page),
    ] {
        let lit = halved(&before.scene, light);
        let after = load(&lit_glb(&before.scene, before.document.as_ref(), &lit, &style).unwrap());
        assert_eq!(after.scene.triangles.len(), 2 * before.scene.triangles.len());
        // Instances moved behind their node; their numbers in the list may differ, their sums may not.
        let sums = |scene: &Scene| {
            let mut sums: Vec<(String, [i64; 3])> = (0..scene.objects.len())
                .map(|i| {
                    let name = scene.objects[i].name.clone();
                    let name = if name.starts_with("instance") { "many".to_owned() } else { name };
                    (name, vector_area(scene, i).to_array().map(|x| (x * 1e4).round() as i64))
                })
                .collect();
            sums.sort();
            sums
        };
        assert_eq!(sums(&before.scene), sums(&after.scene));
        let bounds = |scene: &Scene| scene.bounding_box().unwrap();
        assert!((bounds(&before.scene)[0] - bounds(&after.scene)[0]).length() < 1e-6);
        assert!((bounds(&before.scene)[1] - bounds(&after.scene)[1]).length() < 1e-6);
    }
}

#[test]
fn what_the_author_wrote_survives_and_what_nobody_uses_goes() {
    let before = load(source().to_string().as_bytes());
    let lit = halved(&before.scene, at_vertices);
    let after = load(&lit_glb(&before.scene, before.document.as_ref(), &lit, &Style::Vertices).unwrap());
    let document = after.document.unwrap();
    let json = &document.json;
    assert_eq!(json["asset"]["copyright"], "kept");
    assert_eq!(json["nodes"][0]["extras"]["kept"], 1);
    assert_eq!(json["materials"][0]["extras"]["kept"], 2);
    // The author's own numbers are not ours to renumber.
    assert_eq!(json["extras"], json!({ "bufferView": 3, "kept": "all" }));
    assert_eq!(json["meshes"][0]["primitives"][0]["extras"]["kept"], "part");
    assert_eq!(json["meshes"][0]["name"], "square");
    assert_eq!(json.get("extensionsUsed"), None);
    let size = document.buffers[0].len();
    assert!(size < 20_000 && document.buffers.len() == 1);
    let counts: Vec<u64> = json["accessors"].as_array().unwrap().iter().filter_map(|a| a["count"].as_u64()).collect();
    assert!(!counts.contains(&500), "an accessor that nobody uses was kept: {counts:?}");
}

#[test]
fn lamps_that_were_baked_shine_no_second_time() {
    let mut source = source();
    source["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing", "KHR_lights_punctual"]);
    let bulb = json!({ "type": "point", "name": "bulb", "intensity": 60 });
    source["extensions"] = json!({ "KHR_lights_punctual": { "lights": [bulb] } });
    source["nodes"][5]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    let lit = |source: &Value| {
        let before = load(source.to_string().as_bytes());
        assert_eq!(before.scene.lights.len(), 1);
        let lit = halved(&before.scene, at_vertices);
        let after = load(&lit_glb(&before.scene, before.document.as_ref(), &lit, &Style::Vertices).unwrap());
        (before.scene.lights, after)
    };
    let (lamps, after) = lit(&source);
    // Who lights it anew has them again.
    let told = "carries light at its vertices (_IRRADIANCE), which is not used: light is computed anew, and the lamp that was put aside";
    assert!(after.scene.lights == lamps && after.faults.to_string().contains(told), "{}", after.faults);
    let json = &after.document.unwrap().json;
    assert_eq!(json["nodes"][5], json!({ "name": "a", "extras": { "KHR_lights_punctual": bulb } }));
    assert_eq!((json.get("extensions"), json.get("extensionsUsed")), (None, None));

    // A lamp of another scene has not been baked and stays.
    source["scenes"] = json!([{ "nodes": [0, 1, 2, 3, 4] }, { "nodes": [7] }]);
    let nodes = source["nodes"].as_array_mut().unwrap();
    nodes.push(json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    let (_, after) = lit(&source);
    let json = &after.document.unwrap().json;
    assert_eq!(json["nodes"][7]["extensions"]["KHR_lights_punctual"]["light"], 0);
    assert_eq!(json["extensions"]["KHR_lights_punctual"]["lights"][0], bulb);
    assert_eq!(json["extensionsUsed"], json!(["KHR_lights_punctual"]));
}

#[test]
fn vertex_light_stands_beside_the_authors_colours() {
    let before = load(source().to_string().as_bytes());
    let lit = halved(&before.scene, at_vertices);
    let after = load(&lit_glb(&before.scene, before.document.as_ref(), &lit, &Style::Vertices).unwrap());
    let document = after.document.unwrap();
    let mut seen = 0;
    for object in &after.scene.objects {
        let mesh = &document.json["meshes"][object.source.mesh]["primitives"][object.source.primitive];
        let light = mesh["attributes"]["_IRRADIANCE"].as_u64().unwrap() as usize;
        let light = document.read_vec3(light).unwrap();
        for (value, vertex) in light.iter().zip(object.vertices.clone()) {
            let expected = Vec3::from(field(after.scene.positions[vertex]));
            assert!((*value - expected).length() < 1e-3, "{value} {expected}");
            assert_eq!(after.scene.colors[vertex], [1.0, 0.5, 0.25, 1.0]);
            seen += 1;
        }
    }
    assert_eq!(seen, 6 * 8);
}

#[test]
fn a_lightmap_goes_onto_the_material_in_the_next_free_set() {
    let mut source = source();
    source["materials"].as_array_mut().unwrap().push(json!({ "name": "unused" }));
    let before = load(source.to_string().as_bytes());
    let lit = halved(&before.scene, on_page);
    let style = Style::Lightmap { pages: pages(), encoding: Encoding::Linear, exposure: 0.5 };
    let after = load(&lit_glb(&before.scene, before.document.as_ref(), &lit, &style).unwrap());
    let json = &after.document.as_ref().unwrap().json;
    let primitive = &json["meshes"][0]["primitives"][0];
    assert_eq!(primitive["attributes"]["TEXCOORD_0"], primitive["attributes"]["TEXCOORD_1"]);
    assert_eq!(after.scene.uvs[1][0], Vec2::new(0.25, 0.75));
    let material = &json["materials"][primitive["material"].as_u64().unwrap() as usize];
    assert_eq!(material["name"], "paint");
    let light = &material["extensions"]["MOZ_lightmap"];
    assert_eq!((&light["texCoord"], &light["intensity"]), (&json!(1), &json!(100.0)));
    let texture = &json["textures"][light["index"].as_u64().unwrap() as usize];
    assert_eq!(texture["extras"]["encoding"], "linear");
    assert_eq!(texture["extras"]["scale"], 200.0);
    assert!(
        after
            .faults
            .to_string()
            .contains("carries a lightmap (MOZ_lightmap), which is not used: light is computed anew ("),
        "{}",
        after.faults
    );
    let names =
        |json: &Value| json["materials"].as_array().unwrap().iter().map(|m| m["name"].clone()).collect::<Vec<_>>();
    assert_eq!(names(json), ["paint", "unused"]);
    assert!(json["materials"][1].get("extensions").is_none());

    // It goes onto a copy where something without light uses the original too.
    let after = load(&lit_glb(&before.scene, before.document.as_ref(), &lit[1..], &style).unwrap());
    let json = &after.document.as_ref().unwrap().json;
    assert_eq!(names(json), ["paint", "unused", "paint"]);
    assert!(json["materials"][0].get("extensions").is_none());
    assert!(json["materials"][2]["extensions"]["MOZ_lightmap"].is_object());
}

/// A model that was lit with a lightmap and then at its vertices showed both.
#[test]
fn a_model_that_is_lit_again_has_the_new_light_alone() {
    let lit = |before: &crate::Loaded, style: &Style| {
        let (scene, document) = (&before.scene, before.document.as_ref());
        let lit = match style {
            Style::Lightmap { .. } => halved(scene, on_page),
            _ => halved(scene, at_vertices),
        };
        load(&lit_glb(scene, document, &lit, style).unwrap())
    };
    let has = |loaded: &crate::Loaded| {
        let json = loaded.document.as_ref().unwrap().json.to_string();
        ["MOZ_lightmap", "_IRRADIANCE"].map(|name| json.contains(name))
    };
    let map = Style::Lightmap { pages: pages(), encoding: Encoding::Linear, exposure: 0.5 };
    let first = lit(&load(source().to_string().as_bytes()), &map);
    let second = lit(&first, &Style::Vertices);
    let third = lit(&second, &map);
    assert_eq!([&first, &second, &third].map(has), [[true, false], [false, true], [true, false]]);
}

#[test]
fn both_sides_of_a_surface_become_two_single_sided_layers() {
    let mut json = source();
    json["materials"][0]["doubleSided"] = true.into();
    let before = load(json.to_string().as_bytes());
    let mut lit = halved(&before.scene, at_vertices);
    let mut back = lit[0].clone();
    back.flipped = true;
    for triangle in &mut back.triangles {
        triangle.swap(1, 2);
    }
    lit.push(back);
    let after = load(&lit_glb(&before.scene, before.document.as_ref(), &lit, &Style::Vertices).unwrap());
    let layers: Vec<usize> =
        (0..after.scene.objects.len()).filter(|&i| after.scene.objects[i].name == "plain").collect();
    assert_eq!(layers.len(), 2);
    assert_eq!(vector_area(&after.scene, layers[0]), -vector_area(&after.scene, layers[1]));
    for (layer, sign) in layers.into_iter().zip([1.0, -1.0]) {
        let object = &after.scene.objects[layer];
        assert!(!after.scene.materials[object.material].double_sided);
        assert_eq!(after.scene.normals[object.vertices.start], sign * Vec3::Z);
    }
    assert!(after.scene.materials[after.scene.objects.last().unwrap().material].double_sided);
}

#[test]
fn unlit_colours_are_exposed_luminance_and_lamps_shine() {
    let mut scene = Scene::default();
    let lamp =
        Material { name: "lamp".into(), emissive: [40.0, 20.0, 0.0], base_color: [0.5; 4], ..Material::default() };
    scene.materials = vec![Material { base_color: [0.5, 0.5, 0.5, 1.0], ..Material::default() }, lamp];
    let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
    scene.add_quad("wall", 0, square);
    scene.add_quad("lamp", 1, square.map(|p| p + DVec3::Z));
    let even = |points: &[DVec3]| Light::Vertex { irradiance: vec![[std::f32::consts::PI; 3]; points.len()] };
    let lit = halved(&scene, even);
    let bytes = lit_glb(&scene, None, &lit, &Style::Unlit { exposure: 0.01 }).unwrap();
    let mut faults = radiosity_scene::Faults::default();
    let document = Document::read("t.glb", &bytes, &Memory::default(), &mut faults).unwrap();
    let color = |mesh: usize| {
        let primitive = &document.json["meshes"][mesh]["primitives"][0];
        let material = &document.json["materials"][primitive["material"].as_u64().unwrap() as usize];
        assert!(material["extensions"]["KHR_materials_unlit"].is_object());
        let factor = material["pbrMetallicRoughness"]["baseColorFactor"][0].as_f64().unwrap();
        let color = primitive["attributes"]["COLOR_0"].as_u64().unwrap() as usize;
        (document.read_colors(color).unwrap()[0], factor)
    };
    assert_eq!(
        document.json["materials"].as_array().unwrap().len(),
        2,
        "of our own materials, those in use are written"
    );
    let told = load(&bytes).faults.to_string();
    assert!(told.contains("(--unlit), which are taken for paint"), "{told}");
    // The wall: E/π = 1 cd/m² times the albedo and the exposure.
    let (wall, factor) = color(0);
    assert!((wall[0] - 0.005).abs() < 1e-6 && factor == 1.0, "{wall:?}");
    // The lamp: 40 cd/m² and what it reflects.
    let (lamp, factor) = color(1);
    assert!((lamp[0] - 0.01 * 40.5).abs() < 1e-6 && (lamp[2] - 0.01 * 0.5).abs() < 1e-6 && factor == 1.0, "{lamp:?}");
}

#[test]
fn a_scene_without_gltf_comes_back_as_it_was() {
    let mut scene = Scene { up: Up::Z, name: "room".into(), ..Scene::default() };
    let lamp = Material { name: "lamp".into(), emissive: [4.0, 2.0, 0.0], ..Material::default() };
    scene.materials = vec![Material { name: "wall".into(), ..Material::default() }, lamp];
    let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 2.0, 0.0), DVec3::Y * 2.0];
    scene.add_quad("floor", 0, square);
    scene.add_quad("lamp", 1, square.map(|p| p + DVec3::Z));
    scene.cameras.push(radiosity_scene::Camera::look_at("eye", DVec3::splat(3.0), DVec3::ZERO, DVec3::Z, 1.0));
    let lit = halved(&scene, at_vertices);
    // The lamp gets no light of its own and is written all the same.
    let bytes = lit_glb(&scene, None, &lit[..1], &Style::Vertices).unwrap();
    let after = load(&bytes).scene;
    assert_eq!(after.objects.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["floor", "lamp"]);
    assert_eq!(after.materials[after.objects[1].material].emissive, [4.0, 2.0, 0.0]);
    assert_eq!((after.objects[0].triangles.len(), after.objects[1].triangles.len()), (4, 2));
    // +Z up became +Y up.
    assert!((vector_area(&after, 0) - 2.0 * DVec3::Y).length() < 1e-6, "{}", vector_area(&after, 0));
    let eye = after.cameras[0].world_from_camera.w_axis.truncate();
    assert!((eye - DVec3::new(3.0, 3.0, -3.0)).length() < 1e-5, "{eye}");
}

/// ρ and τ come back to the rounding of single precision, or are refused by the name of their material: they were clamped.
#[test]
fn catalogue_13_a_sheet_comes_back_as_it_was_or_is_refused() {
    let texture = |uv_set| radiosity_scene::TextureRef {
        texture: 0,
        uv_set,
        transform: Default::default(),
        wrap: [radiosity_scene::Wrap::Clamp; 2],
        nearest: false,
    };
    let texels = vec![[128, 64, 32, 51], [255, 0, 200, 255]];
    let picture = radiosity_scene::Texture { name: "p".into(), width: 2, height: 1, texels };
    let plain = Transmission { transmittance: [0.4, 0.2, 0.3], ..Transmission::default() };
    let mixed = Transmission { replaced: 0.7, texture: Some(texture(0)), ..plain.clone() };
    let partly = Transmission { share_texture: Some(texture(0)), ..mixed.clone() };
    let sheet = |transmission: Transmission| Material {
        name: "silk".into(),
        base_color: [0.6, 0.3, 0.1, 1.0],
        base_color_texture: transmission.texture,
        metallic: 0.25,
        transmission: Some(transmission),
        ..Material::default()
    };
    let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 2.0, 0.0), DVec3::Y * 2.0];
    let written = |material: Material| {
        let mut scene = Scene { materials: vec![material], textures: vec![picture.clone()], ..Scene::default() };
        scene.add_quad("sheet", 0, square);
        let [a, b, c, d] = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(Vec2::from);
        scene.uvs[0] = vec![a, b, c, a, c, d];
        let bytes = lit_glb(&scene, None, &[], &Style::Vertices);
        (scene, bytes)
    };
    for transmission in [plain.clone(), mixed, partly] {
        let (before, bytes) = written(sheet(transmission));
        let after = load(&bytes.unwrap());
        assert!(!after.faults.has_errors(), "{}", after.faults);
        let after = after.scene;
        for uv in [(0.1, 0.2), (0.6, 0.3), (0.3, 0.6)] {
            let at = radiosity_scene::Surface { triangle: 0, uv: uv.into() };
            let [there, here] =
                [&before, &after].map(|scene| [scene.reflectance(at), scene.transmittance(at)].concat());
            assert!(there.iter().zip(&here).all(|(a, b)| (a - b).abs() < 1e-6), "{there:?} {here:?}");
        }
    }
    let narrow = Transmission { transmittance: [0.1, 0.9, 0.0], ..plain };
    let (_, refused) = written(sheet(narrow));
    let error = refused.unwrap_err();
    assert!(matches!(&error, WriteError::Material { name, .. } if name == "silk"), "{error}");
}

/// Every object looked through all primitives, so that time went with the square of their number.
#[test]
fn many_objects_are_written_in_time_that_goes_with_their_number() {
    let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
    let lit = |object| LitPrimitive {
        object,
        vertices: Vec::new(),
        triangles: Vec::new(),
        flipped: false,
        light: Light::None,
    };
    for _ in 0..150_000 {
        scene.add_triangles("t", 0, &[[DVec3::ZERO, DVec3::X, DVec3::Y]]);
    }
    let lit: Vec<LitPrimitive> = (0..scene.objects.len()).map(lit).collect();
    let start = std::time::Instant::now();
    assert!(!plain::lit(&scene, &lit, &Style::Vertices).unwrap().is_empty());
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
}

/// A hundred pictures of one file, and a hundred of one view, made the lit file a hundred times as large.
#[test]
fn bytes_that_are_named_many_times_are_written_once() {
    let mut json = source();
    let views = json["bufferViews"].as_array_mut().unwrap();
    let (first, picture) = (views.len(), json!({ "buffer": 0, "byteOffset": 0, "byteLength": 2000 }));
    views.extend(vec![picture; 100]);
    let mut images: Vec<Value> =
        (0..100).map(|i| json!({ "bufferView": first + i, "mimeType": "image/png" })).collect();
    images.extend(vec![json!({ "uri": "a.png" }); 100]);
    json["images"] = images.into();
    let files = Memory([("a.png".to_owned(), vec![1; 3000])].into());
    let before = gltf::load("t.gltf", json.to_string().as_bytes(), &files, &LoadOptions::default()).unwrap();
    let lit = halved(&before.scene, at_vertices);
    let after = load(&lit_glb(&before.scene, before.document.as_ref(), &lit, &Style::Vertices).unwrap());
    let (before, after) = (before.document.unwrap(), after.document.unwrap());
    assert!(after.buffers[0].len() < 30_000, "{}", after.buffers[0].len());
    assert_eq!(after.images.len(), 200);
    for (before, after) in before.images.iter().zip(&after.images) {
        assert_eq!(before.as_ref().unwrap().bytes, after.as_ref().unwrap().bytes);
    }
}

#[test]
fn a_file_is_written_whole_or_not_at_all() {
    let before = load(source().to_string().as_bytes());
    let folder = std::env::temp_dir().join(format!("radiosity-lit-{}", std::process::id()));
    let lit = halved(&before.scene, at_vertices);
    let write = |lit: &[LitPrimitive], file: &str| {
        write_lit(&before.scene, before.document.as_ref(), lit, &Style::Vertices, &folder.join(file))
    };
    assert!(matches!(write(&lit, "a.glb"), Err(WriteError::NoFolder(_))));
    std::fs::create_dir(&folder).unwrap();
    write(&lit, "a.glb").unwrap();
    let first = std::fs::read(folder.join("a.glb")).unwrap();
    // Wrong input leaves the old file alone; a name that is a folder leaves nothing behind.
    let mut wrong = lit.clone();
    wrong[2].vertices[1].corners[2] = 99;
    assert!(matches!(write(&wrong, "a.glb"), Err(WriteError::Primitive { primitive: 2, .. })));
    wrong[2] = LitPrimitive { light: Light::Vertex { irradiance: vec![] }, ..lit[2].clone() };
    assert!(matches!(write(&wrong, "a.glb"), Err(WriteError::Primitive { primitive: 2, .. })));
    assert_eq!(std::fs::read(folder.join("a.glb")).unwrap(), first);
    std::fs::create_dir(folder.join("b.glb")).unwrap();
    assert!(matches!(write(&lit, "b.glb"), Err(WriteError::Io { .. })));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn nothing_that_is_not_finite_is_written() {
    let before = load(source().to_string().as_bytes());
    let bad = |points: &[DVec3]| Light::Vertex { irradiance: vec![[f32::NAN, f32::INFINITY, 1.0]; points.len()] };
    for style in [Style::Vertices, Style::Unlit { exposure: f32::NAN }] {
        let lit = halved(&before.scene, bad);
        let after = load(&lit_glb(&before.scene, before.document.as_ref(), &lit, &style).unwrap());
        let document = after.document.unwrap();
        for index in 0..document.json["accessors"].as_array().unwrap().len() {
            if let Ok((values, _)) = document.read_components(index, &[1, 2, 3, 4]) {
                assert!(values.iter().all(|v| v.is_finite()), "accessors[{index}]");
            }
        }
    }
}

/// Cut at 1, the sun on a grey floor was as dark as the shade beside it, and orange light turned yellow.
#[test]
fn unlit_sun_is_brighter_than_shade_and_keeps_its_hue() {
    let mut scene = Scene {
        materials: vec![Material { base_color: [0.3, 0.3, 0.3, 1.0], ..Material::default() }],
        ..Scene::default()
    };
    let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
    scene.add_quad("floor", 0, square);
    let color = |light: f32| {
        let even =
            |points: &[DVec3]| Light::Vertex { irradiance: vec![[light, 0.5 * light, 0.1 * light]; points.len()] };
        let bytes =
            lit_glb(&scene, None, &halved(&scene, even), &Style::Unlit { exposure: std::f32::consts::PI }).unwrap();
        let mut faults = radiosity_scene::Faults::default();
        let document = Document::read("t.glb", &bytes, &Memory::default(), &mut faults).unwrap();
        let accessor = document.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"].as_u64().unwrap() as usize;
        document.read_colors(accessor).unwrap()[0]
    };
    let (shade, sun) = (color(1.2), color(6.0));
    assert!((shade[0] - 0.36).abs() < 1e-6, "{shade:?}");
    assert!(sun[0] > 2.0 * shade[0] && sun[0] < 1.0, "{sun:?}");
    assert!((0.45..0.65).contains(&(sun[1] / sun[0])), "{sun:?}");
}

/// A scene that was edited in code is read again as it was, lamps included.
#[test]
fn a_dark_scene_keeps_its_lamps_and_cameras() {
    let lamp = |name: &str, kind, range| radiosity_scene::PointLight {
        name: name.to_owned(),
        kind,
        position: DVec3::new(1.0, 2.0, -3.0),
        direction: DVec3::new(0.6, -0.8, 0.0),
        intensity: [300.0, 200.0, 100.0],
        range,
    };
    use radiosity_scene::PointLightKind as Kind;
    let mut scene = Scene {
        materials: vec![Material { emissive: [1000.0, 500.0, 0.0], ..Material::default() }],
        ..Scene::default()
    };
    scene.add_quad("floor", 0, [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y]);
    scene.lights = vec![
        lamp("bulb", Kind::Point, Some(4.0)),
        lamp("spot", Kind::Spot { inner: 0.3, outer: 0.5 }, None),
        lamp("sun", Kind::Directional, None),
    ];
    let eye = DVec3::new(3.0, 1.0, 2.0);
    scene.cameras = vec![radiosity_scene::Camera::look_at("eye", eye, DVec3::ZERO, DVec3::Y, 0.8)];
    let bytes = scene_glb(&scene).unwrap();
    let back = gltf::load("t.glb", &bytes, &Memory::default(), &LoadOptions::default()).unwrap().scene;
    assert_eq!(back.lights.len(), 3);
    for (a, b) in scene.lights.iter().zip(&back.lights) {
        assert_eq!((&a.name, a.range, a.intensity), (&b.name, b.range, b.intensity));
        assert!(a.kind == Kind::Directional || a.position.distance(b.position) < 1e-6, "{b:?}");
        assert!(a.kind == Kind::Point || a.direction.distance(b.direction) < 1e-6, "{b:?}");
    }
    // Beside their light they are put aside, where other programs do not look.
    let lit = halved(&scene, at_vertices);
    let glb = gltf::load(
        "t.glb",
        &plain::lit(&scene, &lit, &Style::Vertices).unwrap(),
        &Memory::default(),
        &LoadOptions::default(),
    )
    .unwrap();
    assert!(!glb.document.unwrap().json["extensionsUsed"].to_string().contains("KHR_lights_punctual"));
    assert_eq!(glb.scene.lights, back.lights);
    assert!(glb.faults.to_string().contains("and 3 lamps that were put aside in it shine again"), "{}", glb.faults);
    assert_eq!(back.materials[0].emissive, scene.materials[0].emissive);
    let place = back.cameras[0].world_from_camera.w_axis.truncate();
    assert!(place.distance(eye) < 1e-5, "{place}");
}

/// In national coordinates, hundreds of kilometres from the origin, single precision has steps of half a metre: a room is written from its middle and
/// read back where it is, to a hundredth of a millimetre.
#[test]
fn places_far_from_the_origin_are_kept() {
    let at = DVec3::new(691_000.25, -12.5, -5_334_000.125);
    let corners = [DVec3::ZERO, DVec3::new(4.003, 0.0, 0.0), DVec3::new(0.0, 2.601, 3.007)];
    for up in [Up::Y, Up::Z] {
        let mut scene = Scene { materials: vec![Material::default()], up, ..Scene::default() };
        scene.add_triangles("far", 0, &[corners.map(|corner| at + corner)]);
        let back = load(&plain::dark(&scene).unwrap()).scene;
        // A zenith along z comes back along y.
        let turned = |p: DVec3| if up == Up::Z { DVec3::new(p.x, p.z, -p.y) } else { p };
        for (read, written) in back.positions.iter().zip(&scene.positions) {
            assert!(read.distance(turned(*written)) < 1e-5, "{read} for {written}");
        }
        assert_eq!(back.positions.len(), 3);
    }
    let mut near = Scene { materials: vec![Material::default()], ..Scene::default() };
    near.add_triangles("near", 0, &[corners]);
    assert_eq!(plain::origin(&near), DVec3::ZERO);
    // What is near is kept as it is, whatever stands far away.
    near.add_triangles("stray", 0, &[corners.map(|corner| at + corner)]);
    assert_eq!(plain::origin(&near), DVec3::ZERO);
}
