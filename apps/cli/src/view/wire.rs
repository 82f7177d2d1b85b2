//! What page and server say to each other. JSON in both directions; triangles and light go out as binary frames:
//!
//! - triangles: `1, object, vertices, triangles, flags` as 32-bit words, then positions (three floats a vertex), texture
//!   coordinates (two, where flag 1 is set), colours of vertices (three, where flag 2 is set), indices (three words a
//!   triangle);
//! - light: `2, epoch`, then runs of `object, first, count` and three half floats for each of `count` vertices, in units of
//!   16 lx, each run padded to whole words. The epoch is that of the page's last choice of a layer.
//!
//! All little-endian.

use super::board::{CHUNK, LightChunk};
use axum::body::Bytes;
use glam::{DVec2, DVec3};
use half::f16;
use radiosity::session::{
    CutElement, Edit, Form, Layer, LightId, ModelLight, ModelObject, ObjectId, PlaneFigures, PlaneQuestion,
};
use radiosity::{Bands, Scene, Surface, Texture, TextureRef, Wrap};
use serde::{Deserialize, Serialize};
use std::f32::consts::PI;

/// Most bytes of a message from a page: an edit of thousands of things at once has as many.
pub const LONGEST: usize = 1 << 20;

/// Most places of a survey, as many as a page's finest grid has.
pub const MOST_PLACES: usize = 4000;

/// Light that a half float of 1 stands for, lx: they reach 65504, and sunlight is brighter than that.
const UNIT: f32 = 16.0;

const MESH: u32 = 1;
const LIGHT: u32 = 2;
pub const CUTS: u32 = 3;
const HAS_UVS: u32 = 1;
const HAS_COLOURS: u32 = 2;

/// A place to look from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPlace {
    /// Name for people.
    pub name: String,
    /// World from camera, by columns.
    pub matrix: [f64; 16],
    /// Vertical angle of view, radians.
    pub fov: f64,
}

/// Everything that a page may ask for.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Request {
    /// Changes the scene. Edits of one gesture, such as a drag, are undone together.
    Edit {
        edit: Edit,
        #[serde(default)]
        gesture: Option<u64>,
    },
    Undo {},
    Redo {},
    /// Looks at another layer of light.
    Layer {
        layer: Layer,
        epoch: u32,
    },
    /// Measures at a place of an object.
    Probe {
        question: u64,
        object: ObjectId,
        triangle: u32,
        uv: [f32; 2],
    },
    /// Measures on a working plane. Of several that a page asks for, the last is answered.
    Plane {
        question: u64,
        about: PlaneQuestion,
    },
    /// Measures at places of one object: triangle, and weights of its corners 1 and 2. In place of a plane.
    Survey {
        question: u64,
        object: ObjectId,
        places: Vec<(u32, f32, f32)>,
    },
    /// Asks how far the picture is off that is seen from a place. Of several that a page asks for, the last is answered.
    InSight {
        question: u64,
        /// World from camera, by columns.
        matrix: [f64; 16],
        /// Vertical angle of view, radians.
        fov: f64,
        /// Width over height.
        aspect: f64,
    },
    /// Asks for the rays of an element.
    Rays {
        question: u64,
        object: ObjectId,
        triangle: u32,
    },
    /// Keeps a camera, in place of one of the same name.
    Bookmark {
        camera: CameraPlace,
    },
    /// Gives one up.
    Forget {
        name: String,
    },
}

/// Everything that the server says, but light and triangles.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Say<'a> {
    Scene {
        name: &'a str,
        version: &'static str,
        up: [f64; 3],
        low: [f64; 3],
        high: [f64; 3],
        cameras: Vec<CameraPlace>,
        sky: Option<SkyPicture>,
    },
    Object {
        id: ObjectId,
        name: &'a str,
        group: u32,
        matrix: [f64; 16],
        reflectance: Bands,
        tint: Bands,
        /// What passes through to the other side.
        transmittance: Bands,
        texture: Option<TextureUse>,
        /// Luminance, cd/m².
        emission: Bands,
        deleted: bool,
        movable: bool,
        /// Of what was added.
        form: Option<Form>,
        /// What it became.
        successor: Option<ObjectId>,
    },
    Light {
        id: LightId,
        name: &'a str,
        r#type: radiosity::session::LightKind,
        dimming: f32,
        colour: Bands,
        /// Candela, or lux of parallel light, before it is dimmed and coloured; none with area.
        intensity: Option<Bands>,
        /// Lumens of an object, before it is dimmed and coloured.
        flux: Option<Bands>,
        /// Lux before it is dimmed and coloured: of the sky on open level ground, of parallel light across its rays.
        illuminance: Option<Bands>,
        /// Half angles of a spot, radians.
        cone: Option<[f64; 2]>,
        matrix: [f64; 16],
        position: Option<[f64; 3]>,
        /// Where spots and parallel light shine to.
        direction: Option<[f64; 3]>,
        object: Option<ObjectId>,
        deleted: bool,
        /// How many lights are shown together, itself among them.
        sharing: usize,
    },
    Bookmarks {
        cameras: &'a [CameraPlace],
    },
    History {
        undo: Option<&'a str>,
        redo: Option<&'a str>,
    },
    Status(Status),
    /// All that was known when the page came has been sent, but light.
    CaughtUp,
    Probe {
        question: u64,
        answer: Option<ProbeAnswer>,
    },
    Plane {
        question: u64,
        /// None if there is no such plane; then why not.
        answer: Option<PlaneAnswer>,
        why: Option<String>,
    },
    Survey {
        question: u64,
        /// Illuminance at each place, lx; none where there is no such place any more.
        lux: Vec<Option<f32>>,
        /// Unit normal of the places, in the scene's axes.
        normal: Option<[f64; 3]>,
        /// One standard error of a place, in the root mean square, over the mean.
        error: f32,
        /// Edits that are in it.
        edits: u64,
        /// Whether the light will stay as it is.
        is_done: bool,
    },
    InSight {
        question: u64,
        /// How far what is shown is off there, over the light; none where there is none.
        error: Option<f64>,
    },
    Rays {
        question: u64,
        rays: Vec<[[f32; 3]; 2]>,
    },
    Refused {
        code: Refused,
        message: String,
    },
}

/// What was refused, for the page; the message beside it is for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Refused {
    /// A change: the scene is as it was.
    Edit,
    /// A camera to keep.
    Camera,
    /// To follow changes in the layer that is shown: it stays as it is.
    Layer,
    /// A message that is none.
    Message,
}

impl Say<'_> {
    /// As JSON.
    pub fn text(&self) -> String {
        // Plain data with text for keys always has a form in JSON.
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// How far the solution is.
#[derive(Clone, Debug, Serialize)]
pub struct Status {
    pub doing: String,
    /// Whether an edit is not seen yet.
    pub is_following: bool,
    pub rays: u32,
    pub most_rays: u32,
    /// Share of all rays that are there.
    pub share: f64,
    pub error: Option<f64>,
    pub seconds: f64,
    /// Seconds to the end, about.
    pub left: Option<f64>,
    pub rays_traced: u64,
    pub elements: usize,
    /// Milliseconds from the last edit to its first complete update.
    pub latency: Option<f64>,
    pub is_done: bool,
    pub edits: u64,
}

/// What is known of a place.
#[derive(Clone, Debug, Serialize)]
pub struct ProbeAnswer {
    pub illuminance: f32,
    /// One standard error of it by the rays of the place, lx.
    pub error: f32,
    pub irradiance: Bands,
    pub reflectance: Bands,
    pub radiosity: Bands,
    /// What each light brings, its reflections too.
    pub lights: Vec<Share>,
    /// From where it arrives: straight from lights, or from surfaces that reflect it.
    pub surfaces: Vec<Share>,
}

/// What was measured on a working plane.
#[derive(Clone, Debug, Serialize)]
pub struct PlaneAnswer {
    /// Place in the scene, metres, and illuminance, lx.
    pub points: Vec<[f64; 4]>,
    #[serde(flatten)]
    pub figures: PlaneFigures,
    /// Edits that are in it.
    pub edits: u64,
    /// Whether the light will stay as it is.
    pub is_done: bool,
}

/// A share of the illuminance of a place.
#[derive(Clone, Debug, Serialize)]
pub struct Share {
    pub name: String,
    pub share: f32,
}

/// The sky as a small picture: rows from the zenith down, columns by azimuth from −X over −Z of a world whose zenith is +Y.
#[derive(Clone, Debug, Serialize)]
pub struct SkyPicture {
    width: usize,
    height: usize,
    luminance: Vec<f32>,
}

/// A picture on an object.
#[derive(Clone, Debug, Serialize)]
pub struct TextureUse {
    index: usize,
    wrap: [&'static str; 2],
    nearest: bool,
}

impl TextureUse {
    fn new(texture: &TextureRef) -> TextureUse {
        let name = |wrap| match wrap {
            Wrap::Repeat => "repeat",
            Wrap::Mirror => "mirror",
            Wrap::Clamp => "clamp",
        };
        TextureUse { index: texture.texture, wrap: texture.wrap.map(name), nearest: texture.nearest }
    }
}

/// An object, without its triangles.
pub fn object(object: &ModelObject, scene: &Scene) -> String {
    let of_scene = object.triangle_of.first().map(|&t| scene.material(t as usize));
    let texture =
        of_scene.and_then(|material| material.base_color_texture.as_ref()).filter(|_| object.texture.is_some());
    // Metal's share of the base colour is no diffuse reflectance.
    let diffuse = of_scene.map_or(1.0, |material| 1.0 - material.metallic);
    let is_varied = texture.is_some() || !scene.colors.is_empty();
    // What is black in the file has no pattern to keep under a new coat.
    let pattern = |band: usize| is_varied && object.tint[band] > 0.0;
    let tint = std::array::from_fn(|b| if pattern(b) { object.tint[b] * diffuse } else { object.reflectance[b] });
    Say::Object {
        id: object.id,
        name: &object.name,
        group: object.group,
        matrix: object.matrix,
        reflectance: object.reflectance,
        tint,
        transmittance: transmittance(object, scene),
        texture: texture.map(TextureUse::new),
        emission: object.emission.map(|exitance| exitance / PI),
        deleted: object.deleted,
        movable: object.movable,
        form: object.form,
        successor: object.successor,
    }
    .text()
}

/// Triangles at whose middle the transmittance of an object is looked up, at most: a picture may vary it.
const LOOKS: usize = 64;

/// What passes through an object, on average.
fn transmittance(object: &ModelObject, scene: &Scene) -> Bands {
    let sheet = |t: &&u32| scene.material(**t as usize).transmits();
    let every = object.triangle_of.len().div_ceil(LOOKS).max(1);
    let looks: Vec<Bands> = object
        .triangle_of
        .iter()
        .step_by(every)
        .filter(sheet)
        .map(|&t| scene.transmittance(Surface { triangle: t as usize, uv: DVec2::splat(1.0 / 3.0) }))
        .collect();
    std::array::from_fn(|band| looks.iter().map(|tau| tau[band]).sum::<f32>() / looks.len().max(1) as f32)
}

/// A light.
pub fn light(light: &ModelLight) -> String {
    Say::Light {
        id: light.id,
        name: &light.name,
        r#type: light.kind,
        dimming: light.dimming,
        colour: light.colour,
        intensity: light.intensity,
        flux: light.flux,
        illuminance: light.illuminance,
        cone: light.cone,
        matrix: light.matrix,
        position: light.position,
        direction: light.direction,
        object: light.object,
        deleted: light.deleted,
        sharing: light.sharing,
    }
    .text()
}

/// Sides of the picture of the sky: no more than a background.
const SKY: [usize; 2] = [128, 64];

/// The sky, if there is light in it.
pub fn sky(scene: &Scene) -> Option<SkyPicture> {
    if scene.sky.is_black() {
        return None;
    }
    let [width, height] = SKY;
    let up = scene.up.direction();
    let mut luminance = Vec::with_capacity(3 * width * height);
    for row in 0..height {
        for column in 0..width {
            let zenith = std::f64::consts::PI * (row as f64 + 0.5) / height as f64;
            let azimuth = std::f64::consts::TAU * ((column as f64 + 0.5) / width as f64 - 0.5);
            let [x, y, z] = [zenith.sin() * azimuth.cos(), zenith.cos(), zenith.sin() * azimuth.sin()];
            // The page turns the scene's zenith to +Y, about X.
            let direction = match scene.up {
                radiosity::Up::Y => [x, y, z],
                radiosity::Up::Z => [x, -z, y],
            };
            luminance.extend(scene.sky.luminance(direction.into(), up));
        }
    }
    Some(SkyPicture { width, height, luminance })
}

/// Colours of the author's vertices at those that are drawn; empty where there are none.
fn colours(object: &ModelObject, scene: &Scene) -> Vec<Bands> {
    let white = [1.0; 4];
    let is_white = |t: &u32| scene.triangles[*t as usize].iter().all(|&v| scene.colors[v as usize] == white);
    if scene.colors.is_empty() || object.triangle_of.iter().all(is_white) {
        return Vec::new();
    }
    let mut colours = vec![[1.0; 3]; object.positions.len()];
    for (corners, &t) in object.indices.chunks_exact(3).zip(&object.triangle_of) {
        let of = scene.triangles[t as usize].map(|v| v as usize);
        let [a, b, c] = of.map(|v| scene.positions[v]);
        let normal = (b - a).cross(c - a);
        let scale = 1.0 / normal.length_squared().max(f64::MIN_POSITIVE);
        for &corner in corners {
            let p = DVec3::from(object.positions[corner as usize].map(f64::from)) - a;
            let (v, w) = (p.cross(c - a).dot(normal) * scale, (b - a).cross(p).dot(normal) * scale);
            let weights = [1.0 - v - w, v, w].map(|weight| weight as f32);
            colours[corner as usize] = std::array::from_fn(|band| {
                (0..3).map(|k| weights[k] * scene.colors[of[k]][band]).sum::<f32>().max(0.0)
            });
        }
    }
    colours
}

/// The triangles of an object.
pub fn mesh(object: &ModelObject, scene: &Scene) -> Bytes {
    let colours = colours(object, scene);
    let flag = |is: bool, flag: u32| if is { flag } else { 0 };
    let flags = flag(!object.uvs.is_empty(), HAS_UVS) | flag(!colours.is_empty(), HAS_COLOURS);
    let (vertices, triangles) = (object.positions.len() as u32, (object.indices.len() / 3) as u32);
    let words = [MESH, object.id.0, vertices, triangles, flags].into_iter();
    let floats = object.positions.iter().flatten().chain(object.uvs.iter().flatten());
    let floats = floats.chain(colours.iter().flatten()).map(|x| x.to_bits());
    words.chain(floats).chain(object.indices.iter().copied()).flat_map(u32::to_le_bytes).collect::<Vec<u8>>().into()
}

/// Beside the parts of an element whose edge follows.
const HAS_EDGE: u32 = 1 << 31;

/// The elements of an object that are cut, each with its parts along each side and, where an edge goes through it, which places see the lamp,
/// 32 in a word, and where lines cross the edge, as 16 bits two in a word; and the number that their light has.
pub fn cuts(object: ObjectId, number: u32, cuts: &[CutElement]) -> Bytes {
    let of = |cut: &CutElement| {
        let mut words = vec![cut.element, cut.parts | if cut.edge.is_some() { HAS_EDGE } else { 0 }];
        if let Some(edge) = &cut.edge {
            let bits = |is_lit: &[bool]| (0..).zip(is_lit).fold(0, |bits, (k, is_lit)| bits | u32::from(*is_lit) << k);
            words.extend(edge.is_lit.chunks(32).map(bits));
            let sixteen = |share: &f32| (65535.0 * share.clamp(0.0, 1.0)).round() as u32;
            words.extend(edge.shares.chunks(2).map(|pair| sixteen(&pair[0]) | pair.get(1).map_or(0, sixteen) << 16));
        }
        words
    };
    let words = [CUTS, object.0, number].into_iter().chain(cuts.iter().flat_map(of));
    words.flat_map(u32::to_le_bytes).collect::<Vec<u8>>().into()
}

/// Light at vertices, as it is sent.
pub fn halves(light: &[Bands]) -> Vec<u16> {
    light.iter().flatten().map(|lux| f16::from_f32((lux / UNIT).clamp(0.0, 65504.0)).to_bits()).collect()
}

/// A frame of light.
pub fn light_frame(epoch: u32, chunks: &[LightChunk]) -> Bytes {
    let mut bytes: Vec<u8> = Vec::with_capacity(8 + chunks.len() * (12 + 6 * CHUNK));
    bytes.extend([LIGHT, epoch].into_iter().flat_map(u32::to_le_bytes));
    for LightChunk { object, first, values } in chunks {
        bytes.extend([*object, *first, values.len() as u32 / 3].into_iter().flat_map(u32::to_le_bytes));
        bytes.extend(values.iter().flat_map(|half| half.to_le_bytes()));
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes.into()
}

/// A picture of the scene as PNG; its alpha is not sent, since the light that passes is in the solution.
pub fn texture(texture: &Texture) -> Result<Vec<u8>, String> {
    let pixels: Vec<[u8; 3]> = texture.texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    radiosity::io::image_out::encode_png(texture.width, texture.height, &pixels).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity::session::{Session, SessionOptions};

    #[test]
    fn what_is_no_request_is_refused() {
        let edit = r#"{"kind":"edit","edit":{"light":{"light":0,"dimming":0.5,"colour":[1,1,1]}},"gesture":3}"#;
        assert!(serde_json::from_str::<Request>(edit).is_ok());
        assert_eq!(serde_json::from_str::<Request>(r#"{"kind":"undo"}"#).unwrap(), Request::Undo {});
        let spot = r#"{"kind":{"spot":{"inner":0.3,"outer":0.6}},"position":[0,2,0],"direction":[0,-1,0],"intensity":[9,9,9]}"#;
        let matrix = "[1,0,0,0,0,1,0,0,0,0,1,0,0.5,0,0,1]";
        for right in [
            format!(r#"{{"add_light":{{"light":{spot}}}}}"#),
            r#"{"add_light":{"light":{"name":"sun","kind":"directional","intensity":[9,9,9]}}}"#.to_owned(),
            format!(r#"{{"copy_light":{{"light":3,"matrix":{matrix}}}}}"#),
            r#"{"change_light":{"light":3,"kind":{"spot":{"inner":0.3,"outer":0.6}},"intensity":[9,9,9]}}"#.to_owned(),
            r#"{"change_light":{"light":3,"kind":"point","intensity":[9,9,9]}}"#.to_owned(),
            r#"{"delete_light":{"light":3}}"#.to_owned(),
            r#"{"restore_light":{"light":3}}"#.to_owned(),
        ] {
            let request = format!(r#"{{"kind":"edit","edit":{right}}}"#);
            assert!(serde_json::from_str::<Request>(&request).is_ok(), "{right}");
        }
        let deep = format!(r#"{{"kind":"edit","edit":{}{}}}"#, r#"{"several":["#.repeat(50_000), "]}".repeat(50_000));
        for wrong in [
            "",
            "null",
            "[]",
            r#"{"kind":"format_disk"}"#,
            r#"{"kind":"edit"}"#,
            r#"{"kind":"edit","edit":{"light":{"light":-1,"dimming":0.5,"colour":[1,1,1]}}}"#,
            r#"{"kind":"edit","edit":{"light":{"light":0,"dimming":1e999,"colour":[1,1,1]}}}"#,
            r#"{"kind":"edit","edit":{"add_light":{"light":{"kind":"laser","intensity":[9,9,9]}}}}"#,
            r#"{"kind":"edit","edit":{"add_light":{"light":{"kind":"point","intensity":[9,9,9],"extra":1}}}}"#,
            r#"{"kind":"edit","edit":{"change_light":{"light":3,"kind":"sky","intensity":[9,9,9]}}}"#,
            r#"{"kind":"edit","edit":{"change_light":{"light":3,"kind":"point","intensity":[9,9]}}}"#,
            r#"{"kind":"probe","question":1,"object":0,"triangle":0,"uv":[0.1]}"#,
            r#"{"kind":"probe","question":1,"object":0,"triangle":0,"uv":[0.1,0.2],"extra":1}"#,
            r#"{"kind":"undo","extra":1}"#,
            r#"{"kind":"survey","question":1,"object":0,"places":[[1,0.1]]}"#,
            r#"{"kind":"edit","edit":{"light":{"light":0,"dimming":0.5,"colour":[1,1,1],"extra":1}}}"#,
            r#"{"kind":"edit","edit":{"delete":{"object":0,"extra":1}}}"#,
            r#"{"kind":"edit","edit":{"change_light":{"light":3,"kind":{"spot":{"inner":0.3,"outer":0.6,"x":1}},"intensity":[9,9,9]}}}"#,
            &deep,
        ] {
            assert!(serde_json::from_str::<Request>(wrong).is_err(), "{}", &wrong[..wrong.len().min(80)]);
        }
    }

    #[test]
    fn refusals_have_codes() {
        let text = |code| Say::Refused { code, message: "Why.".to_owned() }.text();
        for (code, name) in [
            (Refused::Edit, "edit"),
            (Refused::Camera, "camera"),
            (Refused::Layer, "layer"),
            (Refused::Message, "message"),
        ] {
            assert_eq!(text(code), format!(r#"{{"kind":"refused","code":"{name}","message":"Why."}}"#));
        }
    }

    #[test]
    fn frames_of_light_are_whole_words() {
        let values = halves(&[[16.0, 32.0, 1e9]]);
        let frame = light_frame(5, &[LightChunk { object: 3, first: 1024, values }]);
        let words: Vec<u32> = frame.chunks(4).map(|w| u32::from_le_bytes(w.try_into().unwrap())).collect();
        assert_eq!(frame.len() % 4, 0);
        assert_eq!(words[..5], [LIGHT, 5, 3, 1024, 1]);
        assert_eq!(words[5..], [0x4000_3c00, 0x7bff]);
    }

    #[test]
    fn colours_of_vertices_are_those_of_the_author_in_between() {
        let mut scene = radiosity::cornell_box();
        let options = SessionOptions { elements: 300, rays: 4, ..SessionOptions::default() };
        let plain = Session::new(scene.clone(), &options).unwrap();
        let model = plain.model();
        assert!(model.objects.iter().all(|object| colours(object, plain.scene()).is_empty()));
        assert_eq!(mesh(&model.objects[0], plain.scene())[16..20], [0; 4], "no flags");

        // Linear in the place, so that what lies between corners is known.
        let colour = |p: DVec3| [0.5 + 0.1 * p.x, 0.5 + 0.1 * p.y, 0.5 + 0.1 * p.z].map(|c| c as f32);
        scene.colors = scene.positions.iter().map(|p| colour(*p)).map(|[r, g, b]| [r, g, b, 1.0]).collect();
        let session = Session::new(scene, &options).unwrap();
        for object in session.model().objects {
            let found = colours(&object, session.scene());
            assert_eq!(found.len(), object.positions.len());
            for (found, p) in found.iter().zip(&object.positions) {
                let right = colour(DVec3::from(p.map(f64::from)));
                assert!(found.iter().zip(right).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?} {right:?}");
            }
            assert_eq!(mesh(&object, session.scene())[16], HAS_COLOURS as u8);
        }
    }
}
