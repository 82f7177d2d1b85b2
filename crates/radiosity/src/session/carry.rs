//! Edits that were checked are carried out.

use super::added::add_to;
use super::edit::Edit;
use super::light::{Light, is_direct, kind_of};
use super::{Form, LightId, ObjectId, Placed, Session};
use glam::{DAffine3, DMat4, DVec3};
use radiosity_scene::{Material, PointLight};
use std::collections::{BTreeMap, BTreeSet};

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

impl Session {
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

/// What an object has become, as often as it was given another form.
pub fn latest(object: ObjectId, successor: impl Fn(usize) -> Option<usize>) -> usize {
    let mut index = object.0 as usize;
    while let Some(next) = successor(index) {
        index = next;
    }
    index
}

fn id(index: usize) -> ObjectId {
    ObjectId(index as u32)
}

pub fn affine(matrix: &[f64; 16]) -> DAffine3 {
    DAffine3::from_mat4(DMat4::from_cols_array(matrix))
}
