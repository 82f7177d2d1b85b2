//! Pairs with something between them: the form factor of what is visible, exact from each point of one part, averaged
//! over its points.
//!
//! From a point, panels are cut out of the other part exactly, so shadow edges on it cost nothing. Over the points the
//! visible factor is continuous with kinks, and cells are divided where it bends. The part that lies farther from the
//! panels, by its own size, is divided: what stands close to a part throws sharp shadows there, which only the exact
//! side resolves.

use super::adaptive::integrate;
use super::clear::Exchange;
use super::panel::Panel;
use super::part::Part;
use super::solid::{Obstacles, looks_away};
use super::visible::{Loop, Shadows, keep_above};
use radiosity_scene::Facet;

/// Places are drawn this much towards the middle: on an edge that both parts share, a factor has no one value.
const INSIDE: f64 = 1e-7;

/// A_i F_ij of two parts past panels; `tolerance` and the answer in m², `whole` is the answer without panels.
pub fn mixed(
    shadows: &mut Shadows,
    [a, b]: [&Part; 2],
    (panels, obstacles): (&mut Vec<&Panel>, Obstacles),
    whole: Exchange,
    tolerance: f64,
    touch: f64,
) -> Exchange {
    let (outer, inner) = if distance(a, b, panels, touch) >= distance(b, a, panels, touch) { (a, b) } else { (b, a) };
    let above = |part: &Part, other: &Part| {
        let mut left: Loop = part.shape.corners().iter().copied().collect();
        let normal = other.shape.normal();
        keep_above(&mut left, normal, normal.dot(other.shape.corners()[0])).then_some(left)
    };
    let (Some(from), Some(target)) = (above(outer, inner), above(inner, outer)) else {
        return Exchange::default();
    };
    let Ok(from) = Facet::new(from.to_vec()) else { return Exchange::default() };
    let normal = outer.shape.normal();

    panels.retain(|panel| !looks_away(panel, obstacles, from.corners(), touch));
    let middle = from.centroid();
    Shadows::sort(middle, normal, &target, panels, touch);
    let found = integrate(&from, tolerance, |x| {
        let x = x + INSIDE * (middle - x);
        shadows.factor(x, normal, &target, panels, touch)
    });
    // What is visible, or what all would be without what is hidden: whichever is known better.
    let [(visible, of_visible), (hidden, of_hidden)] = [0, 1].map(|k| (found.values[k], found.errors[k]));
    let (value, error) = if of_visible <= of_hidden + whole.error {
        (visible, of_visible)
    } else {
        (whole.value - hidden, of_hidden + whole.error)
    };
    Exchange { value: value.clamp(0.0, whole.value), error }
}

/// How far the nearest panel stands from a part on the way to another, by the part's size.
fn distance(part: &Part, other: &Part, panels: &[&Panel], touch: f64) -> f64 {
    let (p, q) = (part.shape.centroid(), other.shape.centroid());
    let share = |panel: &&Panel| {
        let through = |part: &Part| {
            let heights = part.shape.corners().iter().map(|c| panel.height(*c));
            heights.clone().any(|h| h > touch) && heights.clone().any(|h| h < -touch)
        };
        let (h, k) = (panel.height(p), panel.height(q));
        if through(part) || h == k { 0.0 } else { (h / (h - k)).clamp(0.0, 1.0) }
    };
    panels.iter().map(share).fold(1.0, f64::min) / part.radius
}
