//! The one discrete problem that all contenders work on: B = E + R (D + F B) on about as many elements as asked.
//!
//! Light of surfaces, the brightest included, goes through F as the classic methods have it. D, of lamps without area and
//! of the sky, is found once and is the same for all. Elements are uniform and whole: what of them is buried in solids takes
//! part, and what is cut out of them or lets light pass counts as opaque, for polygons are all that the methods know.

use crate::division::{Optics, Sheets};
use crate::monitor::Watch;
use crate::{Error, Monitor};
use radiosity_scene::{Bands, Elements, Enclosure, Mesh, SkyPatches, luminance};
use radiosity_solve::{DiffuseResponse, Response, SheetResponse};
use radiosity_trace::{Place, Tracer};
use radiosity_transport::receivers::Site;
use radiosity_transport::{ElementReceivers, Exposure, HitTable, IdSpace, Luminaires, Receivers, Shadowing};

/// Shadow rays for lamps without area, by element: their edges are as sharp as the elements are large.
const SHADOWING: Shadowing = Shadowing { places: 64, rays: 4 };

/// Rays that find the sky, by element.
const SKY_RAYS: usize = 1024;

/// Elements of a scene with all that the equation needs but F.
pub(super) struct Problem<'a> {
    pub tracer: &'a Tracer<'a>,
    pub elements: Elements,
    /// Width of an element, metres.
    pub size: f64,
    /// Bytes that factors may take.
    pub memory: usize,
    pub enclosure: Enclosure,
    pub area: Vec<f64>,
    /// Direct irradiance of lamps without area and of the sky, lux per band.
    pub direct: Vec<Bands>,
    /// Exitance of each element, lm/m² per band.
    pub exitance: Vec<Bands>,
    /// E + R D, bands interleaved.
    pub emission: Vec<f64>,
    pub reflectance: Vec<f64>,
    pub sheets: Sheets,
}

/// The whole of each element, buried or not: what the other methods look out from.
pub(super) struct Whole<'a>(ElementReceivers<'a>);

impl<'a> Whole<'a> {
    pub fn new(mesh: &'a Mesh, elements: &'a Elements, exposure: &'a Exposure) -> Whole<'a> {
        Whole(ElementReceivers { mesh, elements, exposure })
    }
}

impl Receivers for Whole<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn site(&self, i: usize) -> Option<Site> {
        self.0.site(i)
    }

    fn buried(&self, _tracer: &Tracer, _place: &Place, _seed: u32) -> bool {
        false
    }

    fn places(&self, i: usize, wanted: u32) -> u32 {
        self.0.places(i, wanted)
    }

    fn near(&self, i: usize) -> Option<f64> {
        self.0.near(i)
    }

    fn seed(&self, i: usize) -> u32 {
        self.0.seed(i)
    }
}

/// Width of elements of which there are about `wanted`: the largest that makes so many, found by halving.
pub(super) fn element_size(tracer: &Tracer, wanted: usize) -> f64 {
    let (scene, mesh) = (tracer.scene, tracer.mesh);
    let total = mesh.whole_area();
    let guess = (2.0 * total / wanted.max(1) as f64).sqrt();
    let off = |size: f64| Elements::count(scene, mesh, size).abs_diff(wanted);
    // Counts go in steps, of which the nearest is looked for.
    let tries = (0..=160).map(|step| guess * 2f64.powf(f64::from(step) / 40.0 - 1.0));
    let best = tries.min_by(|a, b| off(*a).cmp(&off(*b)).then(b.total_cmp(a)));
    best.unwrap_or(guess)
}

impl<'a> Problem<'a> {
    pub fn new(
        tracer: &'a Tracer<'a>,
        wanted: usize,
        memory: usize,
        monitor: &dyn Monitor,
    ) -> Result<Problem<'a>, Error> {
        let (scene, mesh) = (tracer.scene, tracer.mesh);
        let size = element_size(tracer, wanted);
        let elements = Elements::new(scene, mesh, size);
        let enclosure = Enclosure::of_elements(mesh, &elements).map_err(Error::Element)?;
        let Optics { area, reflectance, sheets, exitance } = Optics::new(tracer, &elements);
        let n = elements.len();
        let mut problem = Problem {
            tracer,
            elements,
            size,
            memory,
            enclosure,
            area,
            direct: vec![[0.0; 3]; n],
            exitance,
            emission: Vec::new(),
            reflectance: reflectance.iter().flatten().map(|r| f64::from(*r)).collect(),
            sheets,
        };
        problem.direct = problem.direct_light(monitor)?;
        let direct: Vec<f64> = problem.direct.iter().flatten().map(|d| f64::from(*d)).collect();
        let emitted = problem.exitance.iter().flatten().map(|e| f64::from(*e));
        problem.emission = emitted.zip(problem.returned(&direct)).map(|(e, returned)| e + returned).collect();
        if problem.emission.iter().all(|e| *e == 0.0) {
            let what = match direct.iter().all(|d| *d == 0.0) {
                true => "there is no light to compare: no surface emits, and no lamp or sky reaches one",
                false => "there is no light to compare: surfaces send none on, as all that is lit is black",
            };
            return Err(Error::Empty(what));
        }
        Ok(problem)
    }

    fn direct_light(&self, monitor: &dyn Monitor) -> Result<Vec<Bands>, Error> {
        let Problem { tracer, elements, area, .. } = self;
        let (scene, mesh) = (tracer.scene, tracer.mesh);
        let mut direct = vec![[0f32; 3]; elements.len()];
        let exposure = Exposure::default();
        let receivers = Whole::new(mesh, elements, &exposure);
        if !scene.lights.is_empty() {
            // Told of no emission, it takes the lamps alone.
            let lamps = Luminaires::new(tracer, elements, area, &vec![[0.0; 3]; elements.len()]);
            let columns = lamps.columns(tracer, &receivers, &SHADOWING, &Watch(monitor))?;
            direct = (0..elements.len()).map(|i| columns.mean(i)).collect();
        }
        if !scene.sky.is_black() {
            let ids = IdSpace { elements, sky: SkyPatches::new(&scene.sky, scene.up.direction()) };
            let mut table = HitTable::new(area.clone(), &ids);
            let sky = ids.sky.radiosity(&scene.sky);
            table.extend(tracer, (&ids, &sky), &receivers, SKY_RAYS, &Watch(monitor))?;
            for (direct, [a, b]) in direct.iter_mut().zip(table.daylight()) {
                (0..3).for_each(|band| direct[band] += 0.5 * (a[band] + b[band]));
            }
        }
        Ok(direct)
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.area.len()
    }

    /// R; with the areas, where F is reciprocal.
    pub fn response(&self, is_reciprocal: bool) -> SheetResponse {
        let reciprocal_area = is_reciprocal.then(|| self.area.clone());
        self.sheets.response(DiffuseResponse { reflectance: self.reflectance.clone(), bands: 3, reciprocal_area })
    }

    /// R h for an irradiance h, bands interleaved.
    pub fn returned(&self, h: &[f64]) -> Vec<f64> {
        let mut b = vec![0.0; h.len()];
        self.response(false).respond(h, &mut b);
        b
    }

    /// D + F B from F B: irradiance by element, lux per band.
    pub fn irradiance(&self, gathered: &[f64]) -> Vec<[f64; 3]> {
        let both = |(h, d): (&[f64], &Bands)| std::array::from_fn(|band| h[band] + f64::from(d[band]));
        gathered.chunks_exact(3).zip(&self.direct).map(both).collect()
    }

    /// The object that an element is a part of, by name.
    pub fn object(&self, element: usize) -> String {
        let (triangle, _) = self.elements.place(element as u32);
        let source = self.tracer.mesh.source[triangle] as usize;
        let scene = self.tracer.scene;
        let object = scene.triangle_object.get(source).and_then(|o| scene.objects.get(*o as usize));
        object.map(|o| o.name.clone()).unwrap_or_default()
    }
}

/// What a meter or an eye makes of three bands.
pub(super) fn bright(bands: [f64; 3]) -> f64 {
    f64::from(luminance(bands.map(|x| x as f32)))
}
