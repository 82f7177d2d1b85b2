//! Edits are checked as a whole, then carried out.

use super::added::{add_to, name_fault};
use super::edit::{Edit, EditError, MOST_CONE, MOST_DIMMING, MOST_EDITS, MOST_INTENSITY, MOST_LIGHTS, NewLight};
use super::light::{Light, distance, is_direct, kind_of};
use super::{Form, LightId, MOST_COLUMNS, ObjectId, Placed, Session, bytes};
use glam::{DAffine3, DMat3, DMat4, DVec3};
use radiosity_scene::material::MAX_REFLECTANCE;
use radiosity_scene::{Bands, Material, PointLight, PointLightKind};
use radiosity_transport::live::{REACH, World};
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// How much larger or smaller than in the file an object may be made, as a factor of its volume.
const MOST_SCALE: f64 = 1e9;

/// What an edit did.
#[derive(Default)]
pub struct Done {
    pub added: Vec<usize>,
    pub added_lights: Vec<usize>,
    pub objects: BTreeSet<usize>,
    /// Strands whose lamps are elsewhere.
    pub strands: BTreeSet<usize>,
    /// Strands in whose columns lamps were dimmed.
    pub dimmed: BTreeSet<usize>,
    /// The groups of copies by those of their originals.
    pub groups: BTreeMap<u32, u32>,
    /// The group of what is added.
    pub added_group: Option<u32>,
    pub repaints: bool,
    pub traces: bool,
}

/// What is there while a series of edits is checked.
struct Known {
    present: Vec<bool>,
    origin: Vec<Origin>,
    successor: Vec<Option<usize>>,
    shines: Vec<bool>,
    lights: Vec<KnownLight>,
    elements: usize,
}

/// What an object is, or a copy of.
#[derive(Clone)]
enum Origin {
    /// An object that is there already.
    Body(usize),
    /// One that the series adds: its corners in its own axes, and its elements.
    New(Rc<[DVec3]>, usize),
}

impl Known {
    /// An object becomes another, which has its light from then on.
    fn succeed(&mut self, old: usize, new: usize) {
        (self.successor[old], self.successor[new]) = (Some(new), None);
        (self.present[old], self.present[new]) = (false, true);
        self.shines[new] = std::mem::take(&mut self.shines[old]);
    }

    /// What an object is by now.
    fn current(&self, object: ObjectId) -> usize {
        latest(object, |index| self.successor.get(index).copied().flatten())
    }
}

impl Origin {
    fn of_form(form: &Form, world: &World) -> Origin {
        Origin::New(form.triangles().into_iter().flatten().collect(), form.elements(world.element_size))
    }
}

/// What an object has become, as often as it was given another form.
fn latest(object: ObjectId, successor: impl Fn(usize) -> Option<usize>) -> usize {
    let mut index = object.0 as usize;
    while let Some(next) = successor(index) {
        index = next;
    }
    index
}

#[derive(Clone, Copy)]
struct KnownLight {
    is_gone: bool,
    /// None with area.
    lamp: Option<KnownLamp>,
}

/// A light without area, as far as it matters where it is.
#[derive(Clone, Copy)]
struct KnownLamp {
    is_parallel: bool,
    position: DVec3,
    matrix: [f64; 16],
    reach: f64,
}

impl KnownLamp {
    fn of(point: &PointLight, matrix: [f64; 16], reach: f64) -> KnownLamp {
        KnownLamp { is_parallel: point.kind == PointLightKind::Directional, position: point.position, matrix, reach }
    }

    /// Whether it is where shadow rays find it in single precision; parallel light has no place.
    fn is_near(&self, world: &World) -> bool {
        let placed = affine(&self.matrix).transform_point3(self.position);
        // Written so that what is no number is refused, too.
        self.is_parallel || distance(world, placed) <= self.reach
    }
}

/// What is wrong with a light elsewhere.
const TOO_FAR: &str = "it would be too far from the middle of the scene";

impl Session {
    /// Whether an edit can be carried out.
    pub(super) fn check(&self, edit: &Edit) -> Result<(), EditError> {
        let bodies = &self.live.world().bodies;
        let mut known = Known {
            present: bodies.iter().map(|body| body.is_present).collect(),
            origin: (0..bodies.len()).map(Origin::Body).collect(),
            successor: self.objects.iter().map(|object| object.successor).collect(),
            shines: self.objects.iter().map(|object| object.light.is_some()).collect(),
            lights: self
                .lights
                .iter()
                .map(|light| KnownLight {
                    is_gone: light.is_gone,
                    lamp: light.point.as_ref().map(|point| KnownLamp::of(point, light.matrix, light.reach)),
                })
                .collect(),
            elements: self.live.ids(),
        };
        let count = count(edit);
        if count > MOST_EDITS {
            return Err(EditError::TooManyEdits(count));
        }
        self.check_one(edit, &mut known)
    }

    fn check_one(&self, edit: &Edit, known: &mut Known) -> Result<(), EditError> {
        let there = |object: ObjectId, known: &Known| {
            let now = known.current(object);
            match known.present.get(now) {
                None => Err(EditError::UnknownObject(object)),
                Some(false) => Err(EditError::Deleted(object)),
                Some(true) => Ok((now, known.origin[now].clone())),
            }
        };
        // A light without area, and whether it is gone.
        let placeable = |light: LightId, known: &Known| match known.lights.get(light.0 as usize) {
            None => Err(EditError::UnknownLight(light)),
            Some(KnownLight { is_gone, lamp }) => {
                lamp.map(|lamp| (lamp, *is_gone)).ok_or(EditError::NotPlaceable(light))
            }
        };
        let lit = |light: LightId, known: &Known| match placeable(light, known)? {
            (_, true) => Err(EditError::DeletedLight(light)),
            (lamp, false) => Ok(lamp),
        };
        let world = self.live.world();
        let near = |light: LightId, lamp: KnownLamp| {
            if lamp.is_near(world) { Ok(lamp) } else { Err(EditError::ChangeLight { light, why: TOO_FAR }) }
        };
        match edit {
            Edit::Light { light, dimming, colour } => {
                if light.0 as usize >= known.lights.len() {
                    return Err(EditError::UnknownLight(*light));
                }
                if colour.iter().chain([dimming]).any(|x| !(0.0..=MOST_DIMMING).contains(x)) {
                    return Err(EditError::Light { light: *light, dimming: *dimming, colour: *colour });
                }
            }
            Edit::Reflectance { object, reflectance } => {
                there(*object, known)?;
                if reflectance.iter().any(|rho| !(0.0..=MAX_REFLECTANCE).contains(rho)) {
                    return Err(EditError::Reflectance { object: *object, reflectance: *reflectance });
                }
            }
            Edit::Move { object, matrix } => {
                let (_, origin) = there(*object, known)?;
                self.check_place(*object, &origin, matrix)?;
            }
            Edit::MoveLight { light, matrix } => {
                let lamp = lit(*light, known)?;
                check_matrix(matrix)?;
                known.lights[light.0 as usize].lamp = Some(near(*light, KnownLamp { matrix: *matrix, ..lamp })?);
            }
            Edit::ChangeLight { light, kind, intensity } => {
                let lamp = lit(*light, known)?;
                check_lamp(*kind, intensity).map_err(|why| EditError::ChangeLight { light: *light, why })?;
                let is_parallel = *kind == PointLightKind::Directional;
                known.lights[light.0 as usize].lamp = Some(near(*light, KnownLamp { is_parallel, ..lamp })?);
            }
            Edit::AddLight { light } => {
                let lamp = self.check_light(light)?;
                self.check_more(known, 0, Some(KnownLight { is_gone: false, lamp: Some(lamp) }))?;
            }
            Edit::CopyLight { light, matrix } => {
                let lamp = lit(*light, known)?;
                check_matrix(matrix)?;
                let lamp = KnownLamp { matrix: *matrix, ..lamp };
                if !lamp.is_near(world) {
                    return Err(EditError::NewLight(TOO_FAR));
                }
                self.check_more(known, 0, Some(KnownLight { is_gone: false, lamp: Some(lamp) }))?;
            }
            Edit::DeleteLight { light } => {
                lit(*light, known)?;
                known.lights[light.0 as usize].is_gone = true;
            }
            Edit::RestoreLight { light } => {
                if !placeable(*light, known)?.1 {
                    return Err(EditError::LightNotDeleted(*light));
                }
                known.lights[light.0 as usize].is_gone = false;
            }
            Edit::Copy { object, matrix } => {
                let (now, origin) = there(*object, known)?;
                self.check_place(*object, &origin, matrix)?;
                self.check_object(origin, known.shines[now], known)?;
            }
            Edit::Add { object } => {
                if let Some(why) = object.fault(world.half) {
                    return Err(EditError::NewObject(why));
                }
                let origin = Origin::of_form(&object.form, world);
                check_rigid(&object.matrix)?;
                self.check_place(id(known.present.len()), &origin, &object.matrix).map_err(|error| match error {
                    EditError::TooFar { .. } => EditError::NewObject(TOO_FAR),
                    other => other,
                })?;
                self.check_object(origin, object.shines(), known)?;
            }
            Edit::Reshape { object, form, matrix } => {
                let (now, origin) = there(*object, known)?;
                let was_added = match origin {
                    Origin::Body(body) => self.objects[body].form.is_some(),
                    Origin::New(..) => true,
                };
                let fault = if was_added { form.fault(world.half) } else { Some("it is of the file") };
                if let Some(why) = fault {
                    return Err(EditError::Form { object: *object, why });
                }
                let origin = Origin::of_form(form, world);
                check_rigid(matrix)?;
                self.check_place(*object, &origin, matrix)?;
                let new = known.present.len();
                self.check_object(origin, false, known)?;
                known.succeed(now, new);
            }
            Edit::Exchange { gone, back } => {
                let (gone_now, back_now) = (gone.0 as usize, back.0 as usize);
                let became = known.successor.get(back_now).copied().flatten();
                if became != Some(gone_now) || known.successor[gone_now].is_some() {
                    return Err(EditError::NotExchanged { gone: *gone, back: *back });
                }
                there(*gone, known)?;
                known.succeed(gone_now, back_now);
            }
            Edit::Delete { object } => {
                let (now, _) = there(*object, known)?;
                known.present[now] = false;
            }
            Edit::Restore { object } => {
                let now = known.current(*object);
                match known.present.get_mut(now) {
                    None => return Err(EditError::UnknownObject(*object)),
                    Some(true) => return Err(EditError::NotDeleted(*object)),
                    Some(present) => *present = true,
                }
            }
            Edit::Several(edits) => {
                if edits.is_empty() {
                    return Err(EditError::NoEdits);
                }
                for edit in edits {
                    self.check_one(edit, known)?;
                }
            }
        }
        Ok(())
    }

    /// Whether there is room for another object, and its light.
    fn check_object(&self, origin: Origin, shines: bool, known: &mut Known) -> Result<(), EditError> {
        let elements = match &origin {
            Origin::Body(body) => self.live.world().bodies[*body].elements() as usize,
            Origin::New(_, elements) => *elements,
        };
        known.present.push(true);
        known.origin.push(origin);
        known.successor.push(None);
        known.shines.push(shines);
        self.check_more(known, elements + 1, shines.then_some(KnownLight { is_gone: false, lamp: None }))
    }

    /// Whether there is room for more ids, and for a light.
    fn check_more(&self, known: &mut Known, ids: usize, light: Option<KnownLight>) -> Result<(), EditError> {
        if light.is_some() && known.lights.len() >= MOST_LIGHTS {
            return Err(EditError::TooManyLights);
        }
        known.elements += ids;
        known.lights.extend(light);
        let columns = known.lights.len().min(MOST_COLUMNS);
        let (needed, allowed) = (bytes(known.elements, self.live.most().rays, columns), self.memory);
        if needed > allowed { Err(EditError::Memory { needed, allowed }) } else { Ok(()) }
    }

    /// Whether a light is one; what it would be.
    fn check_light(&self, light: &NewLight) -> Result<KnownLamp, EditError> {
        let world = self.live.world();
        let refuse = |why| Err(EditError::NewLight(why));
        if let Some(why) = name_fault(&light.name) {
            return refuse(why);
        }
        if light.position.iter().chain(&light.direction).any(|x| !x.is_finite()) {
            return refuse("its position or direction has a number that is not finite");
        }
        let lamp = KnownLamp {
            is_parallel: light.kind == PointLightKind::Directional,
            position: light.position.into(),
            matrix: DMat4::IDENTITY.to_cols_array(),
            reach: REACH * world.half,
        };
        if !lamp.is_near(world) {
            return refuse(TOO_FAR);
        }
        check_lamp(light.kind, &light.intensity).map_or_else(refuse, |()| Ok(lamp))
    }

    fn check_place(&self, object: ObjectId, origin: &Origin, matrix: &[f64; 16]) -> Result<(), EditError> {
        let placed = check_matrix(matrix)?;
        let world = self.live.world();
        let most = REACH * world.half;
        let away = |p: &DVec3| (placed.transform_point3(*p) - world.middle).abs().max_element();
        let distance = match origin {
            Origin::Body(body) => world.bodies[*body].shape.corners.iter().flatten().map(away).fold(0.0, f64::max),
            Origin::New(corners, ..) => corners.iter().map(away).fold(0.0, f64::max),
        };
        // Written so that what is no number is refused, too.
        if distance <= most { Ok(()) } else { Err(EditError::TooFar { object, distance, most }) }
    }

    /// Carries out an edit that was checked; answers what takes it back.
    pub(super) fn carry_out(&mut self, edit: &Edit, done: &mut Done) -> Edit {
        match edit {
            Edit::Light { light, dimming, colour } => {
                let own = &mut self.lights[light.0 as usize];
                let inverse = Edit::Light { light: *light, dimming: own.dimming, colour: own.colour };
                (own.dimming, own.colour) = (*dimming, *colour);
                let strand = own.strand;
                done.objects.extend(own.body);
                if self.strands[strand].is_shared {
                    done.dimmed.insert(strand);
                }
                inverse
            }
            Edit::Reflectance { object, reflectance } => {
                let index = self.current(*object);
                let own = &mut self.objects[index];
                let before = own.coat.unwrap_or(own.paint.mean);
                own.coat = (*reflectance != own.paint.mean).then_some(*reflectance);
                done.objects.insert(index);
                done.repaints = true;
                Edit::Reflectance { object: id(index), reflectance: before }
            }
            Edit::Move { object, matrix } => {
                let index = self.current(*object);
                let before = std::mem::replace(&mut self.objects[index].matrix, *matrix);
                self.live.place(index, affine(matrix));
                self.touch(index, done);
                Edit::Move { object: id(index), matrix: before }
            }
            Edit::MoveLight { light, matrix } => {
                let own = &mut self.lights[light.0 as usize];
                let before = std::mem::replace(&mut own.matrix, *matrix);
                done.strands.insert(own.strand);
                done.traces = true;
                Edit::MoveLight { light: *light, matrix: before }
            }
            Edit::ChangeLight { light, kind, intensity } => {
                let own = &mut self.lights[light.0 as usize];
                let point = own.point.as_mut().expect("lights without area alone are changed: that was checked");
                let inverse = Edit::ChangeLight { light: *light, kind: point.kind, intensity: point.intensity };
                (point.kind, point.intensity) = (*kind, *intensity);
                own.kind = kind_of(point);
                done.strands.insert(own.strand);
                done.traces = true;
                inverse
            }
            Edit::AddLight { light } => {
                let down = -self.scene().up.direction();
                let point = PointLight {
                    name: light.name.clone(),
                    kind: light.kind,
                    position: light.position.into(),
                    direction: DVec3::from(light.direction).try_normalize().unwrap_or(down),
                    intensity: light.intensity,
                    range: None,
                };
                let light = Light::without_area(point, self.live.world());
                self.put_light(light, done)
            }
            Edit::CopyLight { light, matrix } => {
                let copy = Light { matrix: *matrix, ..self.lights[light.0 as usize].clone() };
                self.put_light(copy, done)
            }
            Edit::DeleteLight { light } => {
                self.set_gone(*light, true, done);
                Edit::RestoreLight { light: *light }
            }
            Edit::RestoreLight { light } => {
                self.set_gone(*light, false, done);
                Edit::DeleteLight { light: *light }
            }
            Edit::Copy { object, matrix } => {
                let copied = self.current(*object);
                let original = self.objects[copied].clone();
                let added = self.live.copy(copied, affine(matrix));
                let light = original.light.map(|light| Light { body: Some(added), ..self.lights[light].clone() });
                // Copies of what belongs together, made together, belong together.
                let new = self.next_group();
                let group = *done.groups.entry(original.group).or_insert(new);
                self.put_object(Placed { matrix: *matrix, light: None, group, ..original }, light, done)
            }
            Edit::Add { object } => {
                let placed = self.make(&object.name, object.material(), object.form, object.matrix);
                let light = Light::of_body(&self.live, self.objects.len(), &object.name, self.mean_exitance);
                // What is added together belongs together.
                let new = self.next_group();
                let group = *done.added_group.get_or_insert(new);
                self.put_object(Placed { group, ..placed }, light, done)
            }
            Edit::Reshape { object, form, matrix } => {
                let old = self.current(*object);
                let Placed { source, coat, group, .. } = self.objects[old].clone();
                let (name, material) = {
                    let object = &self.scene().objects[source];
                    (object.name.clone(), self.scene().materials[object.material].clone())
                };
                // As many lumens as before, where it is.
                let body = &self.live.world().bodies[old];
                let area: f64 = (0..body.elements()).map(|element| body.area(element)).sum();
                let share = (area / form.area()) as f32;
                let material = Material { emissive: material.emissive.map(|emissive| share * emissive), ..material };
                let placed = self.make(&name, material, *form, *matrix);
                let new = self.objects.len();
                self.put_object(Placed { coat, group, ..placed }, None, done);
                self.succeed(old, new, done);
                Edit::Exchange { gone: id(new), back: id(old) }
            }
            Edit::Exchange { gone, back } => {
                let index = back.0 as usize;
                self.live.place(index, affine(&self.objects[index].matrix));
                self.succeed(gone.0 as usize, index, done);
                self.touch(index, done);
                Edit::Exchange { gone: *back, back: *gone }
            }
            Edit::Delete { object } => {
                let index = self.current(*object);
                self.live.remove(index);
                self.touch(index, done);
                Edit::Restore { object: id(index) }
            }
            Edit::Restore { object } => {
                let index = self.current(*object);
                self.live.place(index, affine(&self.objects[index].matrix));
                self.touch(index, done);
                Edit::Delete { object: id(index) }
            }
            Edit::Several(edits) => {
                let mut inverse: Vec<Edit> = edits.iter().map(|edit| self.carry_out(edit, done)).collect();
                inverse.reverse();
                Edit::Several(inverse)
            }
        }
    }

    /// A number for what belongs to nothing that is there.
    fn next_group(&self) -> u32 {
        self.objects.iter().map(|object| object.group).max().unwrap_or(0) + 1
    }

    /// Adds an object that is in the world by now, and its light; answers what takes it back.
    fn put_object(&mut self, placed: Placed, light: Option<Light>, done: &mut Done) -> Edit {
        let index = self.objects.len();
        self.objects.push(placed);
        if let Some(light) = light {
            done.added_lights.push(self.lights.len());
            self.add_light(light);
        }
        done.added.push(index);
        self.touch(index, done);
        Edit::Delete { object: id(index) }
    }

    /// What an object is by now.
    fn current(&self, object: ObjectId) -> usize {
        latest(object, |index| self.objects.get(index).and_then(|placed| placed.successor))
    }

    /// Puts a form into the world.
    fn make(&mut self, name: &str, material: Material, form: Form, matrix: [f64; 16]) -> Placed {
        let source = self.scene().objects.len();
        let body = self.live.add_new(|scene| add_to(scene, name, material, &form), affine(&matrix));
        Placed { matrix, form: Some(form), ..Placed::new(&self.live, source, body, 0) }
    }

    /// An object becomes another, which is there already and has its light from now on.
    fn succeed(&mut self, old: usize, new: usize, done: &mut Done) {
        self.live.remove(old);
        self.touch(old, done);
        (self.objects[old].successor, self.objects[new].successor) = (Some(new), None);
        self.objects[new].light = self.objects[old].light.take();
        if let Some(light) = self.objects[new].light {
            self.lights[light].body = Some(new);
            // As bright as it is now.
            self.lights[light].is_direct = is_direct(&self.live.world().bodies[new].shape, self.mean_exitance);
            self.make_column(light);
        }
    }

    /// Adds a light without area; answers what takes it back.
    fn put_light(&mut self, light: Light, done: &mut Done) -> Edit {
        let index = self.lights.len();
        self.add_light(light);
        done.added_lights.push(index);
        done.strands.insert(self.lights[index].strand);
        done.traces = true;
        Edit::DeleteLight { light: LightId(index as u32) }
    }

    /// Takes a light without area away or brings it back: it is dark meanwhile, and its rays stay; those of a shared column are
    /// shared out anew.
    fn set_gone(&mut self, light: LightId, is_gone: bool, done: &mut Done) {
        let own = &mut self.lights[light.0 as usize];
        own.is_gone = is_gone;
        if self.strands[own.strand].is_shared {
            done.strands.insert(own.strand);
            done.traces = true;
        }
    }

    /// Notes that an object is elsewhere, with its light.
    fn touch(&mut self, index: usize, done: &mut Done) {
        done.objects.insert(index);
        done.traces = true;
        self.state.movers.push(index);
        if let Some(light) = self.objects[index].light {
            done.strands.insert(self.lights[light].strand);
        }
    }

    /// The light with a number.
    pub(super) fn light_of(&self, light: LightId) -> Option<&Light> {
        self.lights.get(light.0 as usize)
    }
}

/// How many edits one is; as far as it matters whether they are too many.
fn count(edit: &Edit) -> usize {
    match edit {
        Edit::Several(edits) => edits.iter().map(count).sum::<usize>().max(1),
        _ => 1,
    }
}

/// Whether a light without area may be so; else why not.
fn check_lamp(kind: PointLightKind, intensity: &Bands) -> Result<(), &'static str> {
    if intensity.iter().any(|x| !(0.0..=MOST_INTENSITY).contains(x)) {
        return Err("its intensity is negative, above 1e12 or no number");
    }
    match kind {
        PointLightKind::Spot { inner, outer } if !(inner >= 0.0 && inner <= outer && outer <= MOST_CONE) => {
            Err("the half angles of a spot go from 0 to 90°, the inner one no farther than the outer")
        }
        _ => Ok(()),
    }
}

fn id(index: usize) -> ObjectId {
    ObjectId(index as u32)
}

fn affine(matrix: &[f64; 16]) -> DAffine3 {
    DAffine3::from_mat4(DMat4::from_cols_array(matrix))
}

/// Whether a matrix turns and moves things, and no more: columns of unit length, square to each other to the right.
fn check_rigid(matrix: &[f64; 16]) -> Result<(), EditError> {
    let turned = check_matrix(matrix)?.matrix3;
    let off = turned.transpose() * turned - DMat3::IDENTITY;
    // Written so that what is no number is refused, too.
    if off.to_cols_array().iter().all(|x| x.abs() <= UNTURNED) { Ok(()) } else { Err(EditError::NotRigid) }
}

/// Rounding of the columns of a matrix that has been turned a thousand times.
const UNTURNED: f64 = 1e-6;

/// Whether a matrix places things as they are, turned, or larger.
fn check_matrix(matrix: &[f64; 16]) -> Result<DAffine3, EditError> {
    if matrix.iter().any(|x| !x.is_finite()) {
        return Err(EditError::NotFinite);
    }
    let last = [matrix[3], matrix[7], matrix[11], matrix[15]];
    if last != [0.0, 0.0, 0.0, 1.0] {
        return Err(EditError::NotAffine(last));
    }
    let placed = affine(matrix);
    let determinant = placed.matrix3.determinant();
    // No column may vanish beside the others either: a plate of no thickness has no normals.
    let lengths = [placed.matrix3.x_axis, placed.matrix3.y_axis, placed.matrix3.z_axis].map(DVec3::length);
    let volume: f64 = lengths.iter().product();
    let is_flat = determinant.is_nan() || determinant <= 1e-6 * volume;
    if is_flat || !(1.0 / MOST_SCALE..=MOST_SCALE).contains(&determinant) {
        return Err(EditError::Determinant(determinant));
    }
    Ok(placed)
}
