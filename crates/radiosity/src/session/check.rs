//! Edits are checked as a whole, before anything is changed.

use super::added::name_fault;
use super::carry::{affine, latest};
use super::edit::{Edit, EditError, MOST_CONE, MOST_DIMMING, MOST_EDITS, MOST_INTENSITY, MOST_LIGHTS, NewLight};
use super::light::distance;
use super::{Form, LightId, MOST_COLUMNS, ObjectId, Session, bytes};
use glam::{DAffine3, DMat3, DMat4, DVec3};
use radiosity_scene::material::MAX_REFLECTANCE;
use radiosity_scene::{Bands, PointLight, PointLightKind};
use radiosity_transport::live::{REACH, World};
use std::rc::Rc;

/// How much larger or smaller than in the file an object may be made, as a factor of its volume.
const MOST_SCALE: f64 = 1e9;

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
                self.check_place(ObjectId(known.present.len() as u32), &origin, &object.matrix).map_err(|error| {
                    match error {
                        EditError::TooFar { .. } => EditError::NewObject(TOO_FAR),
                        other => other,
                    }
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
