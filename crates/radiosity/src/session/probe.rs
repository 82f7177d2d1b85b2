//! What is read from a session: the model, layers of light, the rays of an element.

use super::display::Weights;
use super::model::LightKind;
use super::{Display, Kept, Layer, LightId, Model, ModelCamera, ModelLight, ModelObject, ObjectId, Session, display};
use radiosity_scene::{Bands, PointLightKind, Projection, luminance};
use radiosity_transport::live::Lanes;
use std::sync::Arc;

/// Bounces that are told apart; later ones show the last.
pub const MOST_BOUNCES: u32 = 64;

/// Layers that are kept, so that several pages may look at several, and bounces follow from those before them.
const MOST_KEPT: usize = 8;

/// Luminance of the three bands of a lane.
pub(super) fn luminance_of(lanes: &Lanes<4>) -> f32 {
    luminance([lanes.0[0], lanes.0[1], lanes.0[2]])
}

/// An error in percent of the light there; none in the dark, and where it is more than the light nothing is known.
fn relative(error: &Lanes<4>, h: &Lanes<4>) -> f32 {
    let (error, h) = (luminance_of(error).abs(), luminance_of(h));
    if error > 0.0 { (100.0 * error / h.max(error)).min(100.0) } else { 0.0 }
}

impl Session {
    pub(super) fn display(&self, object: usize) -> &Display {
        let placed = &self.objects[object];
        let world = self.live.world();
        let shape = &world.bodies[object].shape;
        placed.display.get_or_init(|| Display::new(self.scene(), placed.source, shape, world.half))
    }

    /// What to draw.
    pub fn model(&self) -> Model {
        let camera = |camera: &radiosity_scene::Camera| ModelCamera {
            name: camera.name.clone(),
            matrix: camera.world_from_camera.to_cols_array(),
            vertical_fov: match camera.projection {
                Projection::Perspective { vertical_fov } => Some(vertical_fov),
                Projection::Orthographic { .. } => None,
            },
        };
        let mut model = Model {
            name: self.scene().name.clone(),
            objects: Vec::new(),
            lights: Vec::new(),
            cameras: self.scene().cameras.iter().map(camera).collect(),
            bounds: [[0.0; 3]; 2],
            up: self.scene().up.direction().to_array(),
        };
        self.update_model(&mut model);
        model
    }

    /// Brings a model of this session up to date; which objects and lights are new or others than they were. Triangles, which
    /// stay as they are, are made for new objects alone.
    pub fn update_model(&self, model: &mut Model) -> (Vec<ObjectId>, Vec<LightId>) {
        let state = |o: &ModelObject| (o.matrix, o.reflectance, o.tint, o.emission, o.deleted, o.successor, o.light);
        let known = model.objects.len();
        let mut changed = Vec::new();
        let world = self.live.world();
        let mut bounds: Option<[glam::DVec3; 2]> = None;
        for (index, (placed, body)) in self.objects.iter().zip(&world.bodies).enumerate() {
            if body.is_present {
                let (low, high) = (body.bounds.low + world.middle, body.bounds.high + world.middle);
                bounds = Some(bounds.map_or([low, high], |[a, b]| [a.min(low), b.max(high)]));
            }
            let object = &self.scene().objects[placed.source];
            let material = &self.scene().materials[object.material];
            let factor = placed.light.map_or([0.0; 3], |light| self.lights[light].factor());
            let exitance = &body.shape.exitance;
            let mean: Bands = std::array::from_fn(|band| {
                exitance.iter().map(|e| e[band]).sum::<f32>() / exitance.len().max(1) as f32
            });
            let [r, g, b, _] = material.base_color;
            let scale: Bands = match placed.coat {
                Some(coat) => std::array::from_fn(|band| match placed.paint.mean[band] {
                    mean if mean > 0.0 => coat[band] / mean,
                    _ => 1.0,
                }),
                None => [1.0; 3],
            };
            let base = [r, g, b];
            if index == model.objects.len() {
                let display = self.display(index);
                let triangle = |element| (body.shape.triangles.start + body.shape.place(element).0) as u32;
                model.objects.push(ModelObject {
                    id: ObjectId(index as u32),
                    name: object.name.clone(),
                    group: placed.group,
                    matrix: placed.matrix,
                    positions: display.positions.clone(),
                    normals: display.normals.clone(),
                    uvs: display.uvs.clone(),
                    indices: display.indices.clone(),
                    triangle_of: (0..body.elements()).map(triangle).collect(),
                    reflectance: [0.0; 3],
                    texture: material.base_color_texture.map(|texture| texture.texture),
                    tint: [0.0; 3],
                    emission: [0.0; 3],
                    deleted: false,
                    movable: placed.is_movable,
                    form: placed.form,
                    successor: None,
                    light: None,
                });
            }
            let object = &mut model.objects[index];
            let before = state(object);
            object.matrix = placed.matrix;
            object.reflectance = placed.coat.unwrap_or(placed.paint.mean);
            object.tint = std::array::from_fn(|band| base[band] * scale[band]);
            object.emission = std::array::from_fn(|band| mean[band] * factor[band]);
            object.deleted = !body.is_present;
            object.successor = placed.successor.map(|successor| ObjectId(successor as u32));
            object.light = placed.light.map(|light| LightId(light as u32));
            if index >= known || state(object) != before {
                changed.push(object.id);
            }
        }
        let before = std::mem::replace(&mut model.lights, self.model_lights());
        let lights = model.lights.iter().filter(|light| before.get(light.id.0 as usize) != Some(light));
        let lights = lights.map(|light| light.id).collect();
        model.bounds = bounds.unwrap_or([world.middle; 2]).map(|corner| corner.to_array());
        (changed, lights)
    }

    fn model_lights(&self) -> Vec<ModelLight> {
        let world = self.live.world();
        let is_gone = |light: &super::Light| light.is_gone || !self.is_there(light);
        let mut there = vec![0; self.strands.len()];
        self.lights.iter().filter(|light| !is_gone(light)).for_each(|light| there[light.strand] += 1);
        let of = |(index, light): (usize, &super::Light)| {
            let placed = light.placed();
            let position = match (light.body, &placed, light.kind) {
                (Some(body), ..) => Some(world.bodies[body].bounds.ball().0 + world.middle),
                (None, Some(point), LightKind::Point | LightKind::Spot) => Some(point.position),
                _ => None,
            };
            let direction = placed.filter(|_| matches!(light.kind, LightKind::Spot | LightKind::Directional));
            ModelLight {
                id: LightId(index as u32),
                name: light.name.clone(),
                kind: light.kind,
                dimming: light.dimming,
                colour: light.colour,
                intensity: light.point.as_ref().map(|point| point.intensity),
                flux: light.body.map(|body| world.bodies[body].flux()),
                illuminance: match (light.kind, &light.point) {
                    (LightKind::Sky, _) => Some(self.scene().sky.horizontal()),
                    (LightKind::Directional, Some(point)) => Some(point.intensity),
                    _ => None,
                },
                cone: light.point.as_ref().and_then(|point| match point.kind {
                    PointLightKind::Spot { inner, outer } => Some([inner, outer]),
                    _ => None,
                }),
                position: position.map(|p| p.to_array()),
                direction: direction.map(|point| point.direction.to_array()),
                matrix: light.body.map_or(light.matrix, |body| self.objects[body].matrix),
                object: light.body.map(|body| ObjectId(body as u32)),
                deleted: is_gone(light),
                sharing: there[light.strand].max(1),
            }
        };
        self.lights.iter().enumerate().map(of).collect()
    }

    /// Light at the vertices of an object's mesh ([`ModelObject::positions`]): irradiance in lux per band, its standard error
    /// for [`Layer::Error`], that in percent for [`Layer::RelativeError`]. What rays found is averaged over neighbours that differ
    /// by no more than noise, but for errors. Empty for an object that there is not, and for a layer that cannot be told yet ([`Session::has_layer`]). Lights beyond the
    /// 31st share one column, and [`Layer::Light`] shows what all of them bring.
    pub fn light(&self, object: ObjectId, layer: Layer) -> Vec<Bands> {
        let Some(body) = self.live.world().bodies.get(object.0 as usize) else { return Vec::new() };
        let Some(kept) = self.layer(layer) else { return Vec::new() };
        let first = body.first as usize;
        let of = |list: &[Lanes<4>], element: u32| -> Bands {
            list.get(first + element as usize).map_or([0.0; 3], |h| [h.0[0], h.0[1], h.0[2]])
        };
        let at = |element| {
            let (whole, lamps) = (of(&kept.values, element), of(&kept.lamps, element));
            display::Light { lamps, rest: std::array::from_fn(|band| whole[band] - lamps[band]) }
        };
        let is_buried = self.buried(object.0 as usize);
        // An error is not made less.
        let is_error = matches!(layer, Layer::Error | Layer::RelativeError);
        let weights = (!is_error).then(|| self.weights(object.0 as usize, first, &is_buried)).flatten();
        self.display(object.0 as usize).light(at, weights.as_deref(), is_buried)
    }

    /// Whether elements of an object are covered by others.
    pub(super) fn buried(&self, object: usize) -> impl Fn(u32) -> bool {
        move |element| self.live.element(object, element).is_some_and(|(chunk, e)| chunk.is_buried(e))
    }

    /// By what the light at the vertices of an object is averaged in the state that is shown: found once for all its layers.
    fn weights(&self, object: usize, first: usize, is_buried: impl Fn(u32) -> bool) -> Option<Arc<Weights>> {
        let (rays, revision) = (self.state.solved_rays, self.state.revision);
        if rays == 0 {
            return None;
        }
        let lock = || self.weights.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some((_, weights)) = lock().get(&object).filter(|(of, _)| *of == revision) {
            return Some(weights.clone());
        }
        let of = |list: &[Lanes<4>], element: u32| list.get(first + element as usize).map_or(0.0, luminance_of);
        let guide = |element| (of(&self.state.shown, element) - of(&self.state.direct, element)).max(0.0);
        // As of rays of which one in two finds light; rarer light is noisier and stays so.
        let noise = 1.0 / (rays as f32).sqrt();
        let weights = Arc::new(self.display(object).weights(guide, noise, is_buried));
        lock().insert(object, (revision, weights.clone()));
        Some(weights)
    }

    /// Irradiance of each element of an object, in the order of [`ModelObject::indices`]: lux per band.
    pub fn irradiance(&self, object: ObjectId) -> Vec<Bands> {
        let Some(body) = self.live.world().bodies.get(object.0 as usize) else { return Vec::new() };
        let shown = self.state.shown.get(body.first as usize..body.dark() as usize).unwrap_or_default();
        shown.iter().map(|h| [h.0[0], h.0[1], h.0[2]]).collect()
    }

    /// The area of each element of an object that is not buried in other objects, m², as far as rays have shown.
    pub fn exposed_areas(&self, object: ObjectId) -> Vec<f64> {
        let Some(body) = self.live.world().bodies.get(object.0 as usize) else { return Vec::new() };
        let share = |element| self.live.element(object.0 as usize, element).map_or(0.0, |(chunk, e)| chunk.exposed(e));
        (0..body.elements()).map(|element| body.area(element) * f64::from(share(element))).collect()
    }

    /// Whether [`Session::light`] can tell a layer. While an edit is not seen, lamps, paint and rays are those of a scene whose light
    /// is not there yet: the whole light is that of the scene before, and so is what was asked for before; other layers wait.
    pub fn has_layer(&self, layer: Layer) -> bool {
        let cache = self.cache.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let is_kept = |kept: &Kept| (kept.layer, kept.revision) == (layer, self.state.revision);
        layer == Layer::Total || !self.state.is_edited || cache.iter().any(is_kept)
    }

    /// A layer by id, if it can be told. The last ones are kept, as they are asked for object by object. Nothing is found under a lock:
    /// who waits for the other threads may be handed a task that asks for the same.
    fn layer(&self, layer: Layer) -> Option<Kept> {
        if !self.has_layer(layer) {
            return None;
        }
        let revision = self.state.revision;
        let lock = || self.cache.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let known: Vec<Kept> = {
            let mut cache = lock();
            cache.retain(|kept| kept.revision == revision);
            cache.clone()
        };
        if let Some(kept) = known.iter().find(|kept| kept.layer == layer) {
            return Some(kept.clone());
        }
        let values = Arc::new(self.find_layer(layer, &known));
        let kept = Kept { layer, revision, values, lamps: Arc::new(self.lamps_of(layer)) };
        let mut cache = lock();
        cache.retain(|kept| kept.layer != layer);
        if cache.len() == MOST_KEPT {
            cache.remove(0);
        }
        cache.push(kept.clone());
        Some(kept)
    }

    /// The part of a layer that lamps bring directly, by id.
    fn lamps_of(&self, layer: Layer) -> Vec<Lanes<4>> {
        match layer {
            Layer::Total | Layer::Direct | Layer::Bounce(0) => self.state.direct.clone(),
            Layer::Light(light) => self.light_of(light).map_or_else(Vec::new, |light| {
                let strand = &self.strands[light.strand];
                let mut by_id = vec![Lanes::default(); self.live.ids()];
                let columns: Vec<(usize, Bands)> =
                    strand.column.map(|c| (c, self.factor(strand))).into_iter().collect();
                self.live.add_direct(&columns, &mut by_id);
                by_id
            }),
            Layer::Indirect | Layer::Bounce(_) | Layer::Error | Layer::RelativeError => Vec::new(),
        }
    }

    /// Light that comes straight from lights: direct light, and what rows find of emission.
    fn unreflected(&self) -> Vec<Lanes<4>> {
        let mut light = vec![Lanes::default(); self.live.ids()];
        let rays = self.state.solved_rays as usize;
        let emission = self.emission();
        if rays > 0 && emission.iter().any(|e| *e != Lanes::default()) {
            self.live.gather(&emission, rays, &mut light);
        }
        for (light, direct) in light.iter_mut().zip(&self.state.direct) {
            (0..3).for_each(|band| light.0[band] += direct.0[band]);
        }
        light
    }

    fn find_layer(&self, layer: Layer, known: &[Kept]) -> Vec<Lanes<4>> {
        let state = &self.state;
        match layer {
            Layer::Total => state.shown.clone(),
            Layer::Direct => self.unreflected(),
            Layer::Indirect => {
                let direct = self.unreflected();
                let rest = |(all, direct): (&Lanes<4>, Lanes<4>)| {
                    Lanes(std::array::from_fn(|k| (all.0[k] - direct.0[k]).max(0.0)))
                };
                state.shown.iter().zip(direct).map(rest).collect()
            }
            Layer::Bounce(count) => {
                let count = if state.solved_rays > 0 { count.min(MOST_BOUNCES) } else { 0 };
                // From the last one before it that is known.
                let before = |kept: &Kept| match kept.layer {
                    Layer::Bounce(of) if of <= count && kept.values.len() == self.live.ids() => {
                        Some((of, kept.values.clone()))
                    }
                    _ => None,
                };
                let nearest = known.iter().filter_map(before).max_by_key(|(of, _)| *of);
                let (from, mut light) =
                    nearest.map_or_else(|| (0, self.unreflected()), |(of, values)| (of, values.to_vec()));
                let mut given = vec![Lanes::default(); light.len()];
                for _ in from..count {
                    self.answer.reflect(&light, &mut given);
                    self.live.gather(&given, state.solved_rays as usize, &mut light);
                }
                light
            }
            Layer::Light(light) => self.light_of(light).map_or_else(Vec::new, |light| {
                let strand = &self.strands[light.strand];
                let factor = self.factor(strand);
                let mut by_id = vec![Lanes::default(); self.live.ids()];
                match state.columns.get(light.strand).filter(|column| state.has_columns && !column.is_empty()) {
                    Some(column) => {
                        for (h, own) in by_id.iter_mut().zip(column) {
                            (0..3).for_each(|band| h.0[band] = own[band] * factor[band]);
                        }
                    }
                    None => {
                        let columns: Vec<(usize, Bands)> = strand.column.map(|c| (c, factor)).into_iter().collect();
                        let rays = state.solved_rays as usize;
                        if rays > 0 {
                            self.live.gather(&self.emission_of(strand, true), rays, &mut by_id);
                        }
                        self.live.add_direct(&columns, &mut by_id);
                    }
                }
                by_id
            }),
            Layer::Error => {
                let mut errors = self.errors();
                errors.iter_mut().for_each(|error| error.0 = error.0.map(f32::abs));
                errors
            }
            Layer::RelativeError => {
                let mut errors = self.errors();
                errors.iter_mut().zip(&state.shown).for_each(|(error, h)| *error = Lanes([relative(error, h); 4]));
                errors
            }
        }
    }

    /// One standard error of the light of each element, with its sign.
    fn errors(&self) -> Vec<Lanes<4>> {
        if self.state.errors.is_empty() { self.find_errors() } else { self.state.errors.clone() }
    }

    /// The rays of the element that is such a triangle: origin and end, or a point as far as the scene is wide for
    /// those that escape.
    pub fn rays(&self, object: ObjectId, triangle: u32) -> Vec<[[f32; 3]; 2]> {
        let Some((chunk, element)) = self.live.element(object.0 as usize, triangle) else { return Vec::new() };
        let world = self.live.world();
        if !world.bodies[object.0 as usize].is_present {
            return Vec::new();
        }
        let ends = chunk.rays(world, element, 2.0 * world.half);
        ends.into_iter().map(|ends| ends.map(|p| (p + world.middle).as_vec3().to_array())).collect()
    }
}
