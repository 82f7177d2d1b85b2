//! What the solver says: the scene, its state and what was measured, as pages read them.

use super::Solver;
use crate::view::board::{Notice, Subject};
use crate::view::wire::{self, CameraPlace, PlaneAnswer, ProbeAnswer, Say, Share};
use radiosity::session::{
    CutElement, Layer, LightKind, ModelLight, ModelObject, ObjectId, PlaneError, PlaneReading, Probe, Reading, Surveyed,
};
use radiosity::{Bands, luminance};

/// Sources of light that are named at a place, and the least of their shares.
const MOST_SOURCES: usize = 6;
const LEAST_SHARE: f32 = 1e-3;

/// Reflected light of less than this is not missed where the rest is known.
const LEAST_TOLD: f32 = 0.02;

impl Solver {
    pub(super) fn say(&self, subject: Subject, text: String) {
        self.board.post(subject, Notice::Text(text));
    }

    pub(super) fn post_scene(&mut self, placed: Option<CameraPlace>) {
        let [low, high] = self.model.bounds;
        let own = self.model.cameras.iter().filter_map(|camera| {
            Some(CameraPlace { name: camera.name.clone(), matrix: camera.matrix, fov: camera.vertical_fov? })
        });
        let mut cameras: Vec<CameraPlace> = own.collect();
        cameras.extend(placed);
        let text = Say::Scene {
            name: &self.model.name,
            version: env!("CARGO_PKG_VERSION"),
            up: self.model.up,
            low,
            high,
            cameras,
            sky: wire::sky(self.session.scene()),
        }
        .text();
        self.say(Subject::Scene, text);
        for object in &self.model.objects {
            self.post_mesh(object);
            self.post_object(object);
            self.changed.insert(object.id);
        }
        self.model.lights.iter().for_each(|light| self.post_lamp(light));
        self.post_cameras();
        self.post_history();
    }

    /// What is new of objects and lights.
    pub(super) fn post_model(&mut self) {
        let known = self.model.objects.len();
        let (objects, lights) = self.session.update_model(&mut self.model);
        self.model.objects[known..].iter().for_each(|object| self.post_mesh(object));
        self.back.extend(&objects);
        objects.into_iter().for_each(|id| self.post_object(&self.model.objects[id.0 as usize]));
        lights.into_iter().for_each(|id| self.post_lamp(&self.model.lights[id.0 as usize]));
    }

    pub(super) fn post_mesh(&self, object: &ModelObject) {
        let mesh = wire::mesh(object, self.session.scene());
        self.board.post(Subject::Mesh(object.id.0), Notice::Binary(mesh));
    }

    /// Which elements of an object are cut, and the light of a layer as it is sent: of its vertices, and of the places of these elements.
    pub(super) fn light_of(&self, id: ObjectId, layer: Layer) -> (Vec<CutElement>, [Vec<u16>; 2]) {
        let light = self.session.light(id, layer);
        let of_cuts = if light.is_empty() { Vec::new() } else { self.session.light_of_cuts(id, layer, &light) };
        (self.session.cuts(id), [light, of_cuts].map(|light| wire::halves(&light)))
    }

    /// Says how an object is cut, if that has changed, and gives its light as one: of its vertices, and after those of the places
    /// of its cuts, which begin with their number. Layers are sent at different times, and a page has to know which places these are.
    pub(super) fn post_cuts(
        &mut self,
        id: ObjectId,
        cuts: Vec<CutElement>,
        [mut light, of_cuts]: [Vec<u16>; 2],
    ) -> Vec<u16> {
        let known = self.cut.get(&id);
        let is_other = known.map_or(!cuts.is_empty(), |(_, known)| *known != cuts);
        if is_other {
            let number = known.map_or(1, |(number, _)| number + 1);
            self.board.post(Subject::Cuts(id.0), Notice::Binary(wire::cuts(id, number, &cuts)));
            self.cut.insert(id, (number, cuts));
        }
        if !of_cuts.is_empty() {
            let number = self.cut.get(&id).map_or(0, |(number, _)| *number);
            light.extend([number as u16, (number >> 16) as u16, 0]);
            light.extend(of_cuts);
        }
        light
    }

    pub(super) fn post_object(&self, object: &ModelObject) {
        self.say(Subject::Object(object.id.0), wire::object(object, self.session.scene()));
    }

    pub(super) fn post_lamp(&self, light: &ModelLight) {
        self.say(Subject::Light(light.id.0), wire::light(light));
    }

    pub(super) fn post_cameras(&self) {
        self.say(Subject::Bookmarks, Say::Bookmarks { cameras: &self.cameras }.text());
    }

    pub(super) fn post_history(&self) {
        let [undo, redo] = self.history.labels();
        self.say(Subject::History, Say::History { undo, redo }.text());
    }

    pub(super) fn post_status(&self) {
        let status = self.session.status();
        // After a change that finds all rays it takes about as long as the last time.
        let left = match (self.settling, self.settled) {
            (Some(since), Some(took)) => Some((took - since.elapsed().as_secs_f64()).max(0.0)),
            (Some(_), None) if status.is_solved => self.sharpening.left(status.sharpened),
            (Some(_), None) => None,
            _ => self.tracing.left(status.share),
        };
        let doing = match (self.is_done, self.edited.is_some()) {
            (true, _) => match self.latency {
                Some(latency) => format!("Up to date; the last change took {latency:.0} ms to be seen"),
                None => "Up to date".to_owned(),
            },
            (false, true) => "Following the change".to_owned(),
            (false, false) if status.rays == 0 => "First light".to_owned(),
            (false, false) if status.is_solved => "Sharpening edges of shadows".to_owned(),
            (false, false) if status.rays == status.most_rays => "Telling lights apart".to_owned(),
            (false, false) => format!("Tracing rays: {} of {} an element", status.rays, status.most_rays),
        };
        let status = wire::Status {
            doing,
            is_following: self.edited.is_some(),
            rays: status.rays,
            most_rays: status.most_rays,
            share: status.share,
            error: Some(status.error).filter(|error| error.is_finite()),
            seconds: status.seconds,
            left: left.filter(|_| !self.is_done),
            rays_traced: status.rays_traced,
            elements: status.elements,
            latency: self.latency,
            is_done: self.is_done,
            edits: self.edits,
        };
        self.say(Subject::Status, Say::Status(status).text());
    }

    /// A probe as people read it.
    pub(super) fn read(&self, probe: &Probe) -> ProbeAnswer {
        let share = |bands: Bands| if probe.lux > 0.0 { luminance(bands) / probe.lux } else { 0.0 };
        let light = |id: radiosity::session::LightId| {
            let found = self.model.lights.iter().find(|light| light.id == id);
            found.map_or_else(String::new, |light| match (light.name.as_str(), light.kind, light.sharing) {
                (.., sharing) if sharing > 1 => format!("{sharing} lights together"),
                (_, LightKind::Sky, _) => "Sky".to_owned(),
                ("", ..) => format!("light {}", id.0 + 1),
                (name, ..) => name.to_owned(),
            })
        };
        let object = |id: ObjectId| {
            let found = self.model.objects.iter().find(|object| object.id == id);
            found.map_or_else(String::new, |object| object.name.clone())
        };
        let lights = probe.lights.iter().map(|(id, bands)| (light(*id), share(*bands)));
        let straight = ("straight from lights".to_owned(), share(probe.direct));
        let surfaces = probe.objects.iter().map(|(id, bands)| (object(*id), share(*bands)));
        // Reflections are sorted by light only when all else is done.
        let rest = 1.0 - lights.clone().map(|(_, share)| share).sum::<f32>();
        let mut lights = shares("other lights", lights);
        if !lights.is_empty() && rest > LEAST_TOLD {
            lights.push(Share { name: "not told apart yet".to_owned(), share: rest });
        }
        let surfaces = shares("other surfaces", std::iter::once(straight).chain(surfaces));
        ProbeAnswer {
            illuminance: probe.lux,
            error: probe.error,
            irradiance: probe.irradiance,
            reflectance: probe.reflectance,
            radiosity: probe.radiosity,
            lights: whole(lights),
            surfaces: whole(surfaces),
        }
    }

    pub(super) fn tell_survey(&self, question: u64, surveyed: &Surveyed) -> String {
        let there: Vec<&Reading> = surveyed.readings.iter().flatten().collect();
        let mean = there.iter().map(|reading| f64::from(reading.lux)).sum::<f64>() / there.len().max(1) as f64;
        let square = there.iter().map(|reading| f64::from(reading.error).powi(2)).sum::<f64>();
        let error = (square / there.len().max(1) as f64).sqrt();
        Say::Survey {
            question,
            lux: surveyed.readings.iter().map(|reading| reading.map(|reading| reading.lux)).collect(),
            normal: there.first().map(|reading| reading.normal),
            error: if mean > 0.0 { (error / mean) as f32 } else { 0.0 },
            edits: self.edits,
            is_done: self.is_done,
        }
        .text()
    }

    pub(super) fn tell_plane(&self, question: u64, measured: Result<PlaneReading, PlaneError>) -> String {
        let why = measured.as_ref().err().map(|error| format!("No working plane: {error}."));
        let answer = measured.ok().map(|reading| PlaneAnswer {
            points: reading
                .points
                .iter()
                .map(|p| [p.position[0], p.position[1], p.position[2], p.lux.into()])
                .collect(),
            figures: reading.figures,
            edits: self.edits,
            is_done: self.is_done,
        });
        Say::Plane { question, answer, why }.text()
    }
}

/// The largest shares, and what those left out bring together, however little each; primitives of one name are one thing to people.
fn shares(others: &str, named: impl Iterator<Item = (String, f32)>) -> Vec<Share> {
    let mut shares: Vec<Share> = Vec::new();
    for (name, share) in named {
        match shares.iter_mut().find(|known| known.name == name) {
            Some(known) => known.share += share,
            None => shares.push(Share { name, share }),
        }
    }
    shares.sort_by(|a, b| b.share.total_cmp(&a.share));
    let named = shares.iter().take(MOST_SOURCES).take_while(|known| known.share >= LEAST_SHARE).count();
    let rest: f32 = shares.drain(named..).map(|left_out| left_out.share).sum();
    if rest >= LEAST_SHARE {
        shares.push(Share { name: others.to_owned(), share: rest });
    }
    shares
}

/// Shares of all that is told: people add them up. Of lights less than [`LEAST_TOLD`] is not told, of surfaces less than [`LEAST_SHARE`].
fn whole(mut shares: Vec<Share>) -> Vec<Share> {
    let sum: f32 = shares.iter().map(|known| known.share).sum();
    shares.iter_mut().for_each(|known| known.share /= sum);
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_named_is_told_together() {
        let lamps = (0..13).map(|k| (format!("lamp {}", k % 12), 0.076));
        let told = shares("other lights", lamps);
        assert_eq!(told.len(), MOST_SOURCES + 1);
        assert_eq!((told[0].name.as_str(), told[MOST_SOURCES].name.as_str()), ("lamp 0", "other lights"));
        let sum: f32 = told.iter().map(|told| told.share).sum();
        assert!((told[0].share - 0.152).abs() < 1e-6 && (sum - 13.0 * 0.076).abs() < 1e-5);
    }

    /// Each of them was left out as too little, and the rest did not add up to 100 %.
    #[test]
    fn what_is_little_is_told_together_with_what_else_is() {
        let books = (0..8).map(|k| (format!("book {k}"), 0.0005));
        let told = whole(shares("other surfaces", std::iter::once(("ceiling".to_owned(), 0.996)).chain(books)));
        assert_eq!(told.iter().map(|told| told.name.as_str()).collect::<Vec<_>>(), ["ceiling", "other surfaces"]);
        assert!((told[1].share - 0.004).abs() < 1e-6 && (told[0].share - 0.996).abs() < 1e-6, "{}", told[1].share);
        // What is less than is told at all is spread over the rest.
        let told = whole(shares(
            "other lights",
            [("lamp", 0.6), ("sun", 0.39), ("sky", 0.0002)].map(|(n, s)| (n.to_owned(), s)).into_iter(),
        ));
        assert_eq!(told.len(), 2);
        assert!((told.iter().map(|told| told.share).sum::<f32>() - 1.0).abs() < 1e-6);
        assert!(whole(Vec::new()).is_empty());
    }
}
