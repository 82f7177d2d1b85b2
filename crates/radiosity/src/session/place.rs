//! What a meter tells that is held to a surface: light, and where it comes from.

use super::{LightId, ObjectId, Probe, Session, SurfacePlace};
use radiosity_scene::{Bands, luminance};
use radiosity_transport::live::Lanes;
use std::collections::BTreeMap;

fn add(sum: &mut Bands, share: f64, light: Bands) {
    (0..3).for_each(|band| sum[band] += share as f32 * light[band]);
}

/// The brightest first, without what brings nothing.
fn brightest<Id: Copy + Ord>(from: impl Iterator<Item = (Id, Bands)>) -> Vec<(Id, Bands)> {
    let mut list: Vec<(Id, Bands)> = from.filter(|(_, light)| luminance(*light) > 0.0).collect();
    list.sort_by(|a, b| luminance(b.1).total_cmp(&luminance(a.1)).then(a.0.cmp(&b.0)));
    list
}

impl Session {
    /// Measures at a place by rays of its own, as a [`Survey`](super::Survey) does: how much light there is, and what brings it. None
    /// if there is no such place, while there is no light, and while an edit is not seen.
    pub fn probe(&self, place: &SurfacePlace) -> Option<Probe> {
        let (meter, (position, normal)) = (self.meter()?, self.place_of(place)?);
        let arrival =
            self.live.arrive((position, normal), meter.columns.iter().map(|(column, _)| *column), meter.target);
        let factors = || meter.columns.iter().map(|(_, factor)| *factor);
        let halves = arrival.halves(&self.state.given, factors());
        let irradiance: Bands = std::array::from_fn(|band| 0.5 * (halves[0][band] + halves[1][band]));

        let of = |list: &[Lanes<4>], id: u32| -> Bands {
            list.get(id as usize).map_or([0.0; 3], |h| [h.0[0], h.0[1], h.0[2]])
        };
        let mut direct = Bands::default();
        let mut straight: BTreeMap<usize, Bands> = BTreeMap::new();
        for ((column, factor), [a, b]) in meter.columns.iter().zip(&arrival.direct) {
            let light: Bands = std::array::from_fn(|band| (0.5 * (a[band] + b[band])) as f32 * factor[band]);
            add(&mut direct, 1.0, light);
            straight.insert(*column, light);
        }
        let world = self.live.world();
        let emission = self.emission();
        let mut objects: BTreeMap<usize, Bands> = BTreeMap::new();
        for (id, share) in arrival.shares() {
            let (given, emitted) = (of(&self.state.given, id), of(&emission, id));
            add(&mut direct, share, emitted);
            if let Some(body) = world.body_of_id(id) {
                add(objects.entry(body).or_default(), share, std::array::from_fn(|band| given[band] - emitted[band]));
            }
        }

        let mut lights: Vec<(LightId, Bands)> = Vec::new();
        for (number, (strand, factor)) in self.strands.iter().zip(&self.state.factors).enumerate() {
            let Some(light) = strand.lights.first() else { continue };
            let mut own = strand.column.and_then(|column| straight.get(&column).copied()).unwrap_or_default();
            let emission = self.emission_of(strand, true);
            let column = self.state.columns.get(number).filter(|column| self.state.has_columns && !column.is_empty());
            for (id, share) in arrival.shares() {
                add(&mut own, share, of(&emission, id));
                if let Some(column) = column {
                    let reflected = self.answer.reflected(id, |id| column[id as usize]);
                    add(&mut own, share, std::array::from_fn(|band| factor[band] * reflected[band]));
                }
            }
            lights.push((LightId(*light as u32), own));
        }

        let (body, placed) = (&world.bodies[place.object.0 as usize], &self.objects[place.object.0 as usize]);
        let (t, ..) = body.point(place.triangle, place.uv);
        let (reflectance, _) = placed.paint.of(place.triangle, body.shape.fronts, placed.coat);
        let factor = placed.light.map_or([0.0; 3], |light| self.lights[light].factor());
        let exitance = body.shape.exitance.get(t).copied().unwrap_or_default();
        let behind = self.answer.through(body.first + place.triangle, |id| of(&self.state.shown, id));
        Some(Probe {
            object: place.object,
            triangle: (body.shape.triangles.start + t) as u32,
            position: position.to_array(),
            normal: normal.to_array(),
            lux: luminance(irradiance),
            irradiance,
            reflectance,
            radiosity: std::array::from_fn(|band| {
                exitance[band] * factor[band] + reflectance[band] * irradiance[band] + behind[band]
            }),
            direct,
            error: arrival.error(&self.state.given, factors()),
            lights: brightest(lights.into_iter()),
            objects: brightest(objects.into_iter().map(|(body, light)| (ObjectId(body as u32), light))),
        })
    }
}
