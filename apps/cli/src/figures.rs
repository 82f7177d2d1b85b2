//! What each figure of a report means, in a line. The page shows it beside the figure, the data carries it as `about`.

pub const ASKED: &str = "largest relative error that was asked for, over all surfaces together";
pub const ESTIMATED: &str = "the audit's best estimate of the relative error";
pub const UPPER: &str = "one-sided 95 % bound: with 95 % confidence the error is smaller";
pub const LOWER: &str = "one-sided 95 % bound: with 95 % confidence the error is larger";
pub const LOWER_IS_ZERO: &str = "one-sided 95 % bound: the audit cannot tell the error from none";
pub const SOLUTION: &str = "the same for the solution, before it is written into texels or vertices";
pub const BIAS: &str = "mean difference over mean illuminance";

pub const LOW: &str =
    "95 % of the area that any light reaches gets more; the rest are corners, cracks, places behind things";
pub const MEAN: &str = "by area, over all that any light reaches";
pub const MEDIAN: &str = "half of the lit area gets more";
pub const LARGEST: &str = "the brightest element";
pub const UNIFORMITY: &str =
    "low over mean, of all surfaces; not the least over mean of a task area, for which there is the verb measure";

pub const EMITTED: &str = "given off by luminous surfaces";
pub const FROM_POINT_LIGHTS: &str = "received from lights without area: point, spot, directional";
pub const FROM_SKY: &str = "received from the sky";
pub const ABSORBED: &str = "taken up by surfaces";
pub const ESCAPED: &str = "left the scene";
pub const LOST_ON_BACKS: &str =
    "ended on black backs of one-sided surfaces; much of it means flipped faces or open solids";
pub const DEFECT: &str = "(in − out) / in, before any repair; noise of the rays, less with more rays";

pub const CLOSURE: &str =
    "an element's form factors, with sky and outside, sum to one; largest distance from it, before any repair";
pub const RESIDUAL: &str = "what the solved equation still lacks, relative to its right-hand side";
pub const BOUND: &str =
    "lm/m²; no element's radiosity is farther from the exact solution of the discrete equation, by ‖r‖∞/(1 − ρ max)";
pub const DISPLAYED: &str = "ΔE*ab, of 100 from black to white; what that bound may change of what an exposed, tone-mapped picture shows of any surface";
pub const STEPS: &str = "times that light was passed on between all elements";
pub const ELEMENTS: &str = "pieces that the surfaces were cut into";
pub const RAYS: &str =
    "from each cell, to find what it sees; where direct light varies, a cell is several elements, which share them";
pub const BURIED: &str = "elements inside solids, which take no part in the light";

pub const SECONDS: &str = "wall clock, from start to the writing of files";
pub const THREADS: &str = "the answer does not depend on their number";
pub const MEMORY: &str = "most that the process held at a time";

/// For data: paths in a report's JSON and what stands there.
pub const ABOUT: &[(&str, &str)] = &[
    ("error.asked", ASKED),
    ("error.estimated", ESTIMATED),
    ("error.upper_95_one_sided", UPPER),
    ("error.lower_95_one_sided", LOWER),
    ("error.bias", BIAS),
    (
        "error.dim",
        "places answered to have less than a tenth of the root mean square illuminance, which hardly count in the error: below (lx), their share of all places, and the error there, relative to what is there, infinite (null) where paths tell nothing; all of it null where they are less than a twentieth of all",
    ),
    ("error.solution_estimated", SOLUTION),
    ("illuminance.low", "lx; 95 % of the area that any light reaches gets more"),
    ("illuminance.mean", "lx; by area, over all exposed surfaces"),
    ("illuminance.classes", "lx; share of the exposed area from one illuminance to another"),
    ("rounds", "after each round of refinement: error as estimated, upper as its one-sided 95 % bound, seconds so far"),
    (
        "written_rounds",
        "error as read back after each attempt; points are texels or vertices, lit those that were not known before",
    ),
    ("lightmap.needed", "texels that the error asked would take, about; null where it is met or this is not known"),
    ("balance", "lm by colour band, for a flux of that band alone"),
    ("balance.defect", DEFECT),
    ("solution.element_size", "m; width of an element, of the widest where what is seen has smaller ones"),
    ("solution.raw_closure", CLOSURE),
    ("solution.relative_residual", RESIDUAL),
    ("solution.guaranteed_bound", BOUND),
    ("solution.displayed.delta_e", DISPLAYED),
    ("solution.steps", STEPS),
    ("time.stages", "seconds by stage; they sum to the whole"),
    ("time.seconds", SECONDS),
    ("peak_memory_mb", "MB (2^20 bytes); most that the process held at a time; null where the system does not tell"),
    ("lightmap.seams_after", "lx; root mean square difference across seams, after fitting them"),
];
