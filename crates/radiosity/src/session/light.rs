//! The lights of a session, and the columns that their light is solved in.

use super::model::LightKind;
use glam::DVec3;
use radiosity_scene::{Bands, PointLight, PointLightKind, Scene, luminance};
use radiosity_transport::live::{Lamp, Live, REACH, Shape, World};
use radiosity_transport::luminaires::BRIGHT;

/// Lights with a column of their own; those beyond share the last one. A column takes 32 bytes per element, and five of them
/// the time of one solve.
pub const MOST_COLUMNS: usize = 32;

/// One light.
#[derive(Clone, Debug)]
pub struct Light {
    pub kind: LightKind,
    pub name: String,
    pub dimming: f32,
    pub colour: Bands,
    /// By columns, from the file's world to its place.
    pub matrix: [f64; 16],
    /// As the file has it; none for objects and the sky.
    pub point: Option<PointLight>,
    /// Farthest from the middle of the scene that it may be as a point or a spot, metres: as all lights, or as the file has it.
    pub reach: f64,
    /// The object that it is.
    pub body: Option<usize>,
    /// Whether shadow rays go to it; other lights are found by rows.
    pub is_direct: bool,
    /// Where its light is solved.
    pub strand: usize,
    /// Whether it was taken away by itself. Its rays stay, but in a shared column, where others need them.
    pub is_gone: bool,
}

impl Light {
    /// As the file has it, to which shadow rays go.
    pub fn new(kind: LightKind, name: &str) -> Light {
        Light {
            kind,
            name: name.to_owned(),
            dimming: 1.0,
            colour: [1.0; 3],
            matrix: glam::DMat4::IDENTITY.to_cols_array(),
            point: None,
            reach: 0.0,
            body: None,
            is_direct: true,
            strand: 0,
            is_gone: false,
        }
    }

    /// An object that shines; nothing of others.
    pub fn of_body(live: &Live, body: usize, name: &str, mean_exitance: f64) -> Option<Light> {
        let shape = &live.world().bodies[body].shape;
        let shines = shape.exitance.iter().flatten().any(|e| *e > 0.0);
        let is_direct = is_direct(shape, mean_exitance);
        shines.then(|| Light { body: Some(body), is_direct, ..Light::new(LightKind::Object, name) })
    }

    /// A light without area.
    pub fn without_area(point: PointLight, world: &World) -> Light {
        let light = Light::new(kind_of(&point), &point.name);
        // Parallel light has no place that could be taken for one.
        let own = if point.kind == PointLightKind::Directional { 0.0 } else { distance(world, point.position) };
        Light { reach: (own * ROUNDING).max(REACH * world.half), point: Some(point), ..light }
    }

    /// By what its light is multiplied.
    pub fn factor(&self) -> Bands {
        if self.is_gone { [0.0; 3] } else { self.colour.map(|c| c * self.dimming) }
    }

    /// A light without area where it is now.
    pub fn placed(&self) -> Option<PointLight> {
        let mut light = self.point.clone()?;
        let matrix = glam::DMat4::from_cols_array(&self.matrix);
        light.position = matrix.transform_point3(light.position);
        let turned = matrix.transform_vector3(light.direction);
        light.direction = turned.try_normalize().unwrap_or(light.direction);
        Some(light)
    }
}

/// What is far away in a file may be turned there, which moves it by rounding: a billionth is more than that of thousands of
/// turns, and less than anybody moves a lamp.
const ROUNDING: f64 = 1.0 + 1e-9;

/// How far a place is from the middle of the scene, as far as reach goes.
pub fn distance(world: &World, position: DVec3) -> f64 {
    (position - world.middle).abs().max_element()
}

/// What a light without area is to people.
pub fn kind_of(point: &PointLight) -> LightKind {
    match point.kind {
        PointLightKind::Point => LightKind::Point,
        PointLightKind::Spot { .. } => LightKind::Spot,
        PointLightKind::Directional => LightKind::Directional,
    }
}

/// Lights that are solved together: one, or those beyond [`MOST_COLUMNS`].
#[derive(Clone, Debug, Default)]
pub struct Strand {
    pub lights: Vec<usize>,
    /// Column of direct light.
    pub column: Option<usize>,
    /// Whether its lights are dimmed before it is solved and not after.
    pub is_shared: bool,
}

/// Mean exitance of all that is there, lm/m².
pub fn mean_exitance(live: &Live) -> f64 {
    let (mut power, mut area) = (0f64, 0f64);
    for body in &live.world().bodies {
        power += f64::from(luminance(body.flux()));
        area += (0..body.elements()).map(|element| body.area(element)).sum::<f64>();
    }
    power / area.max(f64::MIN_POSITIVE)
}

/// Whether an object shines so brightly beside a mean over what there is that shadow rays go to it, by the
/// brightest of its triangles; and what rows would not get right, emission that varies within triangles.
pub fn is_direct(shape: &Shape, mean_exitance: f64) -> bool {
    let peak = shape.exitance.iter().map(|e| luminance(*e)).fold(0f32, f32::max);
    shape.is_varied || shape.is_see_through || f64::from(peak) > BRIGHT * mean_exitance
}

/// A point light as it hangs from a ceiling: nobody turns what shines in all directions, and glTF has −Z for what is not turned.
/// Made a spot or parallel light it shines down, unless its node was turned.
fn hung(point: &PointLight, scene: &Scene) -> PointLight {
    let is_unturned = point.kind == PointLightKind::Point && point.direction.abs_diff_eq(DVec3::NEG_Z, UNTURNED);
    PointLight { direction: if is_unturned { -scene.up.direction() } else { point.direction }, ..point.clone() }
}

/// Rounding of a direction in files.
const UNTURNED: f64 = 1e-6;

/// The lights of a scene: objects that shine, lights without area, the sky.
pub fn lights_of(live: &Live, mean_exitance: f64) -> Vec<Light> {
    let scene = &live.world().scene;
    let bodies = 0..scene.objects.len();
    let shining = bodies.filter_map(|body| Light::of_body(live, body, &scene.objects[body].name, mean_exitance));
    let mut lights: Vec<Light> = shining.collect();
    lights.extend(scene.lights.iter().map(|point| Light::without_area(hung(point, scene), live.world())));
    if !scene.sky.is_black() {
        lights.push(Light { is_direct: false, ..Light::new(LightKind::Sky, "sky") });
    }
    lights
}

/// The strand that another light joins, given how many there are.
pub fn strand_of(strands: &mut Vec<Strand>, light: usize) -> usize {
    if strands.len() < MOST_COLUMNS {
        let is_shared = strands.len() + 1 == MOST_COLUMNS;
        strands.push(Strand { lights: Vec::new(), column: None, is_shared });
    }
    let strand = strands.len() - 1;
    strands[strand].lights.push(light);
    strand
}

/// The lamps of a strand's column, with what each is multiplied by in it. Those of a shared column share its rays by their power,
/// so those that are gone are not among them.
pub fn lamps(strand: &Strand, lights: &[Light]) -> (Vec<Lamp>, Vec<Bands>) {
    let takes_rays = |light: &&Light| light.is_direct && !(strand.is_shared && light.is_gone);
    let direct = strand.lights.iter().map(|light| &lights[*light]).filter(takes_rays);
    direct
        .filter_map(|light| {
            let lamp = match light.body {
                Some(body) => Lamp::Body(body),
                None => Lamp::Point(light.placed()?),
            };
            Some((lamp, if strand.is_shared { light.factor() } else { [1.0; 3] }))
        })
        .unzip()
}
