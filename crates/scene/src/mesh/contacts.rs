//! Contacts: lines along which an opaque surface stands on another one or goes through it, as walls do with floors.
//!
//! Where a floor goes on below a wall in one polygon, its elements lie on both sides and carry light from one room into
//! the next. So surfaces are cut along their contacts, and both have the same vertices there. A contact is an edge that
//! lies on a triangle of which it is no edge itself, with a face that rises from there, or the line in which two triangles
//! cross (Möller 1997, "A fast triangle-triangle intersection test"). Surfaces that lie flat on each other have none, nor
//! has what is not opaque: grass would cut the ground to pieces, and light goes through it.
//!
//! Not every contact cuts. What is shorter than an element cannot part rooms: the legs of a table leave the floor as it is
//! ([`LEAST_RUN`], [`WALL`]). Only two cut at any length: the edge where a sheet ends, for a hut of sheets in a wide landscape is smaller
//! than an element; and under the sky or the sun a sheet that does not face up, as the lining of a roof, and whatever goes through it from
//! side to side, for beams are as bright as day outside. And a triangle that is lit on one side of its contacts only, as where a pillow sinks
//! into a couch, has nothing to be parted from: what of it is buried is left out of its elements anyway.

use super::boxes::Boxes;
use super::cut::Cutter;
use super::edges::{is_balanced, ordered};
use super::weld::Weld;
use super::{CREASE, Mesh, STANDING, Union, WHOLE};
use crate::{AlphaMode, PointLightKind, Scene};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// Contacts cut where they reach this far, together with those that go on from them about straight on, in widths of an
/// element: what is shorter cannot part rooms, and an element lies around it anyway. At half of it the books of a furnished
/// office cut their shelves to pieces, 118,000 triangles of 54,000 instead of 70,000; at twice, short walls no longer cut.
const LEAST_RUN: f64 = 1.0;

/// Elements that the scene's area makes by default, from which their width follows. The mesh is the same for all.
const ELEMENTS: f64 = 10_000.0;

/// Contacts so long cut however wide elements are, metres: a wall of that length parts rooms. On a site of 400 m elements are wider than
/// the rooms of a house, and none of its walls cut.
const WALL: f64 = 1.0;

/// Contacts in one place that each is compared with. Several are one, from the triangles on both sides of an edge and the
/// hosts on both sides of another; beyond this, runs come out too short.
const MOST_JOINED: usize = 32;

/// Boxes and triangles that the search for contacts compares: this many at most for each triangle of the scene, and
/// [`LEAST_SEARCH`]. Beyond it, where large triangles lie across everything, contacts are no longer looked for
/// ([`Mesh::uncut`]). It keeps the time linear in the triangles; twice as many take twice as long in such a scene, and any
/// other never gets there.
const SEARCH: u64 = 500;

/// Small scenes may compare so many: of the order of a second.
const LEAST_SEARCH: u64 = 1 << 27;

/// Contacts that are kept for each triangle of the scene, and at least: memory for scenes in which all goes through all.
/// Those of real ones have less than one for ten.
const CONTACTS: usize = 2;
const LEAST_CONTACTS: usize = 1 << 16;

/// Boxes whose contacts are searched for at the same time: enough work for many threads, and little to repeat.
const AT_ONCE: usize = 4096;

/// What faces up by more than this has ground behind it and no sky: grass, posts and legs end there.
const FACES_UP: f64 = 0.1;

/// Pairs of contacts on one triangle that are compared; where there are more it is cut.
const MOST_COMPARED: usize = 1 << 12;

/// Where surfaces meet.
#[derive(Default)]
pub(super) struct Contacts {
    /// Vertices on contacts.
    pub vertices: Vec<u32>,
    /// The contacts, and the edges of what they lie on, as they were.
    pub edges: Vec<(u32, u32)>,
}

/// A line on a triangle, the host, along which another one meets it.
struct Contact {
    host: u32,
    other: u32,
    line: Line,
    /// How many of its ends lie on sides of the host, where it crosses a sheet that may have the sky behind it: of all contacts with the sheet
    /// two do if the host goes through.
    at_sides: u8,
    /// Whether it does, or is what goes through the host.
    is_through: bool,
}

/// Where a contact is: millions are kept in a scene in which all goes through all.
enum Line {
    /// An edge of the other triangle, by its vertices.
    Edge(u32, u32),
    /// The line between two places, in which the triangles cross.
    Crossing([DVec3; 2]),
}

impl Mesh {
    /// Cuts surfaces along their contacts.
    pub(super) fn cut_along_contacts(&mut self, scene: &Scene, weld: &mut Weld) -> Contacts {
        let area = self.whole_area();
        let (mut list, found_all) = self.contacts(scene);
        let run = LEAST_RUN * (2.0 * area / ELEMENTS).sqrt();
        let needs_ends = |contact: &Contact| contact.at_sides > 0 || matches!(contact.line, Line::Edge(..));
        let ends = if list.iter().any(needs_ends) { self.ends_of_surfaces() } else { Vec::new() };
        self.find_through(&mut list, &ends);
        self.keep_long(&mut list, run.min(WALL), &ends);
        list.sort_by_key(|contact| contact.host);

        // Where a triangle that has to be cut crosses another one, the other is cut there too: light breaks at a line
        // only where both have their vertices on it.
        let parted: Vec<u32> = list
            .chunk_by(|a, b| a.host == b.host)
            .filter(|contacts| {
                contacts.iter().any(|contact| contact.is_through) || self.parts(scene, contacts, run > WALL)
            })
            .map(|contacts| contacts[0].host)
            .collect();
        let is_parted = |t: u32| parted.binary_search(&t).is_ok();
        list.retain(|contact| {
            is_parted(contact.host) || (matches!(contact.line, Line::Crossing(_)) && is_parted(contact.other))
        });

        // Cut them, each triangle in its place.
        let mut contacts = Contacts::default();
        let mut pieces: Vec<(u32, Vec<[u32; 3]>)> = Vec::new();
        let mut cutter = Cutter::new(&mut self.vertices, weld);
        for run in list.chunk_by(|a, b| a.host == b.host) {
            let host = run[0].host;
            let corners = self.triangles[host as usize];
            let ends = |contact: &Contact| match contact.line {
                Line::Edge(a, b) => [a, b],
                Line::Crossing(ends) => ends.map(|p| cutter.vertex(p)),
            };
            let mut edges: Vec<(u32, u32)> = run.iter().map(ends).map(|[a, b]| ordered(a, b)).collect();
            edges.retain(|(a, b)| a != b);
            edges.sort_unstable();
            edges.dedup();
            if let Some(list) = cutter.cut(corners, &edges, &mut contacts.vertices) {
                pieces.push((host, list));
            }
            contacts.edges.extend((0..3).map(|i| ordered(corners[i], corners[(i + 1) % 3])));
            contacts.edges.extend(edges);
        }
        self.uncut = !found_all || cutter.gave_up();
        if !pieces.is_empty() {
            self.replace(&pieces);
        }
        contacts
    }

    /// The contacts of all triangles, and whether these are all.
    fn contacts(&self, scene: &Scene) -> (Vec<Contact>, bool) {
        let mut left = (SEARCH * self.triangles.len() as u64).max(LEAST_SEARCH);
        let most_kept = (CONTACTS * self.triangles.len()).max(LEAST_CONTACTS);
        let (boxes, mut list) = (Boxes::new(self), Vec::new());
        // From the largest triangles down, so that what is not reached is clutter.
        let mut end = boxes.leaves();
        while end > 0 {
            let homes = end.saturating_sub(AT_ONCE)..end;
            end = homes.start;
            if let Some(found) = self.contacts_within(scene, &boxes, homes.clone(), left, most_kept - list.len()) {
                for (contacts, compared) in found {
                    list.extend(contacts);
                    left -= compared;
                }
                continue;
            }
            // A limit is here: one after the other, for it to be at the same place whatever the number of threads.
            for home in homes.rev() {
                let has_room = |s, t| {
                    self.meet(scene, [s, t], &mut list);
                    list.len() < most_kept
                };
                if !boxes.pairs(home, self.tolerance, &mut left, has_room) {
                    return (list, false);
                }
            }
        }
        (list, true)
    }

    /// The contacts of the triangles in some boxes, from the last box on, and how many comparisons that took; none where the
    /// limits do not allow for all of them.
    fn contacts_within(
        &self,
        scene: &Scene,
        boxes: &Boxes,
        homes: std::ops::Range<usize>,
        left: u64,
        most_kept: usize,
    ) -> Option<Vec<(Vec<Contact>, u64)>> {
        let (kept, compared) = (AtomicUsize::new(0), AtomicU64::new(0));
        homes
            .into_par_iter()
            .rev()
            .map(|home| {
                let (mut own, mut rest) = (Vec::new(), left);
                let found_all = boxes.pairs(home, self.tolerance, &mut rest, |s, t| {
                    self.meet(scene, [s, t], &mut own);
                    own.len() < most_kept
                });
                let kept = kept.fetch_add(own.len(), Ordering::Relaxed) + own.len();
                let compared = compared.fetch_add(left - rest, Ordering::Relaxed) + left - rest;
                (found_all && kept < most_kept && compared <= left).then_some((own, left - rest))
            })
            .collect()
    }

    /// The ends of a contact.
    fn ends(&self, contact: &Contact) -> [DVec3; 2] {
        match contact.line {
            Line::Edge(a, b) => [a, b].map(|v| self.vertices[v as usize]),
            Line::Crossing(ends) => ends,
        }
    }

    /// Keeps the contacts that extend over a length, with those that go on from them about straight on, edges at which
    /// surfaces end, and what goes through a sheet.
    fn keep_long(&self, list: &mut Vec<Contact>, length: f64, ends: &[(u32, u32)]) {
        let (mut weld, mut places) = (Weld::new(self.tolerance), Vec::new());
        let at: Vec<u32> =
            list.iter().flat_map(|contact| self.ends(contact)).map(|p| weld.vertex(&mut places, p)).collect();
        let count = places.len();
        drop((weld, places));

        // The ends by their places: where the list of each place starts, and the contacts there.
        let mut next = vec![0u32; count + 1];
        at.iter().for_each(|place| next[*place as usize + 1] += 1);
        for place in 0..count {
            next[place + 1] += next[place];
        }
        let mut here = vec![0u32; at.len()];
        for (end, place) in at.into_iter().enumerate() {
            let slot = &mut next[place as usize];
            here[*slot as usize] = end as u32 / 2;
            *slot += 1;
        }

        let mut runs = Union::new(list.len());
        let (mut start, mut along) = (0, Vec::new());
        for &end in &next[..count] {
            let here = &here[start..end as usize];
            start = end as usize;
            along.clear();
            along.extend(here.iter().map(|n| {
                let [a, b] = self.ends(&list[*n as usize]);
                (b - a).normalize_or_zero()
            }));
            for (k, n) in here.iter().enumerate() {
                for (m, back) in here.iter().zip(&along).skip(k + 1).take(MOST_JOINED) {
                    if along[k].dot(*back).abs() > CREASE.cos() {
                        runs.join(*n as usize, *m as usize);
                    }
                }
            }
        }
        drop((here, next));

        let runs = runs.names();
        let count = runs.iter().map(|run| *run as usize + 1).max().unwrap_or_default();
        let mut bounds = vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; count];
        for (contact, run) in list.iter().zip(&runs) {
            let [low, high] = &mut bounds[*run as usize];
            for end in self.ends(contact) {
                (*low, *high) = (low.min(end), high.max(end));
            }
        }
        let is_end =
            |contact: &Contact| matches!(contact.line, Line::Edge(a, b) if ends.binary_search(&ordered(a, b)).is_ok());
        let mut reach = runs.into_iter().map(|run| bounds[run as usize]).map(|[low, high]| low.distance(high));
        list.retain(|contact| {
            reach.next().is_some_and(|reach| reach > length) || is_end(contact) || contact.is_through
        });
        list.shrink_to_fit();
    }

    /// The edges at which a surface ends, in order.
    fn ends_of_surfaces(&self) -> Vec<(u32, u32)> {
        let sides = self.sides_of_edges();
        let open = sides.chunk_by(|a, b| a.edge == b.edge).filter(|faces| !is_balanced(faces));
        open.map(|faces| faces[0].edge).collect()
    }

    /// Finds the contacts with sheets that their hosts go through. A sheet is a part of the mesh that ends somewhere, at one of
    /// these `ends`.
    fn find_through(&self, list: &mut [Contact], ends: &[(u32, u32)]) {
        if list.iter().all(|contact| contact.at_sides == 0) {
            return;
        }
        let mut parts = Union::new(self.vertices.len());
        for [a, b, c] in &self.triangles {
            parts.join(*a as usize, *b as usize);
            parts.join(*a as usize, *c as usize);
        }
        let parts = parts.names();
        let mut is_sheet = vec![false; self.vertices.len()];
        ends.iter().for_each(|(end, _)| is_sheet[parts[*end as usize] as usize] = true);
        let part = |t: u32| parts[self.triangles[t as usize][0] as usize];
        let place = |contact: &Contact| (contact.host, part(contact.other));
        let of_sheet = |n: &u32| list[*n as usize].at_sides > 0 && is_sheet[place(&list[*n as usize]).1 as usize];
        let mut met: Vec<u32> = (0..list.len() as u32).filter(of_sheet).collect();
        met.sort_by_key(|n| place(&list[*n as usize]));
        let mut through: Vec<(u32, u32)> = Vec::new();
        for same in met.chunk_by(|a, b| place(&list[*a as usize]) == place(&list[*b as usize])) {
            if same.iter().map(|n| list[*n as usize].at_sides).fold(0, u8::saturating_add) > 1 {
                through.push(place(&list[same[0] as usize]));
            }
        }
        // Both are cut there: light breaks only where both have their vertices.
        let is_through = |place: (u32, u32)| through.binary_search(&place).is_ok();
        for contact in list {
            let Contact { host, other, .. } = *contact;
            contact.is_through = is_through((host, part(other))) || is_through((other, part(host)));
        }
    }

    /// Puts pieces in the place of triangles, which come in ascending order.
    fn replace(&mut self, pieces: &[(u32, Vec<[u32; 3]>)]) {
        let (mut triangles, mut source, mut split) = (Vec::new(), Vec::new(), Vec::new());
        let mut pieces = pieces.iter().peekable();
        for (t, corners) in self.triangles.iter().enumerate() {
            let whole = std::slice::from_ref(corners);
            let list = pieces.next_if(|(host, _)| *host as usize == t).map_or(whole, |(_, list)| list);
            let place = |v: u32| match corners.iter().position(|c| *c == v) {
                Some(corner) => WHOLE[corner],
                None => self.barycentric(t, self.vertices[v as usize]),
            };
            for piece in list {
                triangles.push(*piece);
                source.push(self.source[t]);
                split.push(if piece == corners { WHOLE } else { piece.map(place) });
            }
        }
        (self.triangles, self.source, self.split) = (triangles, source, split);
    }

    /// Adds the contacts of two triangles.
    fn meet(&self, scene: &Scene, pair: [u32; 2], list: &mut Vec<Contact>) {
        let names = pair.map(|t| self.triangles[t as usize]);
        if names[0].iter().filter(|v| names[1].contains(v)).count() > 1 {
            return;
        }
        let corners = pair.map(|t| self.corners(t as usize));
        let doubled = corners.map(|[a, b, c]| (b - a).cross(c - a));

        // The corners of each lie on the plane of the other, or on both of its sides.
        let on_sides = |of: usize| {
            let (origin, up) = (corners[1 - of][0], doubled[1 - of]);
            let margin = self.tolerance * self.tolerance * up.length_squared();
            let heights = corners[of].map(|p| (p - origin).dot(up)).map(|h| if h * h <= margin { 0.0 } else { h });
            let [a, b, c] = heights;
            let apart = a * b > 0.0 && b * c > 0.0 || heights == [0.0; 3];
            (!apart).then_some(heights)
        };
        let (Some(above), Some(below)) = (on_sides(0), on_sides(1)) else { return };
        let heights = [above, below];
        let normals = doubled.map(|n| n.normalize_or_zero());
        let line = normals[0].cross(normals[1]);
        if line.length() < STANDING {
            return;
        }

        // Each is cut by the other if that stops light, on a side that is lit; a sliver has no inside to cut.
        let hosts = [0, 1].map(|host| {
            let [a, b, c] = corners[host];
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let material = |t: u32| scene.material(self.source[t as usize] as usize);
            let lit = material(pair[host]).has_two_sides() || heights[1 - host].iter().any(|h| *h > 0.0);
            let wide = (b - a).cross(c - a).length() >= 8.0 * self.tolerance * longest;
            lit && wide && material(pair[1 - host]).alpha_mode == AlphaMode::Opaque
        });

        // Where one goes through the plane of the other, from side to side, and how many of these places lie within a line there.
        let along = line.normalize();
        let spans = [0, 1].map(|of| self.crossings(names[of], heights[of], along));
        let place = |p: &DVec3| p.dot(along);
        let up = scene.up.direction();
        let at_sides = |host: usize, [from, to]: [DVec3; 2]| match spans[host] {
            Some([p, q]) if normals[1 - host].dot(up) <= FACES_UP && is_under_sky(scene) => {
                u8::from(place(&p) >= place(&from)) + u8::from(place(&q) <= place(&to))
            }
            _ => 0,
        };

        // An edge of the one that lies on the other, or else the line in which they cross.
        let edges = heights.map(|h| (0..3).find(|i| h[*i] == 0.0 && h[(i + 1) % 3] == 0.0));
        for (of, edge) in edges.iter().enumerate() {
            let (Some(i), true) = (edge, hosts[1 - of]) else { continue };
            let ends = [corners[of][*i], corners[of][(i + 1) % 3]];
            if length_within(ends, corners[1 - of], normals[1 - of], self.tolerance) > 2.0 * self.tolerance {
                let line = Line::Edge(names[of][*i], names[of][(i + 1) % 3]);
                let ordered = if place(&ends[0]) <= place(&ends[1]) { ends } else { [ends[1], ends[0]] };
                let at_sides = at_sides(1 - of, ordered);
                list.push(Contact { host: pair[1 - of], other: pair[of], line, at_sides, is_through: false });
            }
        }
        if edges != [None, None] || !hosts.contains(&true) {
            return;
        }
        let [Some(p), Some(q)] = spans else { return };
        let from = if place(&p[0]) > place(&q[0]) { p[0] } else { q[0] };
        let to = if place(&p[1]) < place(&q[1]) { p[1] } else { q[1] };
        if place(&to) - place(&from) > 2.0 * self.tolerance {
            let crossed = (0..2).filter(|host| hosts[*host]);
            let contact = |host: usize| {
                let (line, at_sides) = (Line::Crossing([from, to]), at_sides(host, [from, to]));
                Contact { host: pair[host], other: pair[1 - host], line, at_sides, is_through: false }
            };
            list.extend(crossed.map(contact));
        }
    }

    /// Whether contacts on one triangle part what is lit of it: a surface that is lit on both sides does, and so do two that
    /// look away from each other. Behind a single one-sided surface all is dark, but not far behind the walls of a room without outsides whose
    /// floor is a part of a wide ground: there are two that look at each other.
    fn parts(&self, scene: &Scene, list: &[Contact], is_wide: bool) -> bool {
        // The ends of each, and the unit normal of the other triangle, if all is dark on its back.
        let seen = |contact: &Contact| {
            let double_sided = scene.material(self.source[contact.other as usize] as usize).has_two_sides();
            (self.ends(contact), (!double_sided).then(|| self.normal(contact.other as usize)))
        };
        let host = self.corners(list[0].host as usize);
        let goes_on_behind = |front: DVec3, [end, _]: &[DVec3; 2]| {
            is_wide && host.iter().any(|corner| (*corner - *end).dot(front) < -WALL)
        };
        let list: Vec<([DVec3; 2], Option<DVec3>)> = list.iter().map(seen).collect();
        let mut compared = 0;
        list.iter().enumerate().any(|(n, (a, front))| {
            let Some(front) = *front else { return true };
            let may_be_room = goes_on_behind(front, a);
            list[n + 1..].iter().any(|(b, other)| {
                compared += 1;
                let on = |side: f64, front: DVec3, of: &[DVec3; 2], all: &[DVec3; 2]| {
                    all.iter().all(|end| side * (*end - of[0]).dot(front) <= self.tolerance)
                };
                let away = |side: f64, other: DVec3| on(side, front, a, b) && on(side, other, b, a);
                compared > MOST_COMPARED
                    || other.is_none_or(|other| {
                        let is_opposite = front.dot(other) < 0.0;
                        (is_opposite && away(1.0, other)) || (may_be_room && !away(1.0, other) && away(-1.0, other))
                    })
            })
        })
    }

    /// Where the sides of a triangle go through a plane above which its corners have these heights, in order along a
    /// direction. The same for both triangles of an edge.
    fn crossings(&self, names: [u32; 3], heights: [f64; 3], along: DVec3) -> Option<[DVec3; 2]> {
        let place = |v: u32| self.vertices[v as usize];
        let corners = (0..3).filter(|i| heights[*i] == 0.0).map(|i| place(names[i]));
        let sides = (0..3).map(|i| [i, (i + 1) % 3]).filter(|[i, j]| heights[*i] * heights[*j] < 0.0).map(|[i, j]| {
            let [i, j] = if names[i] < names[j] { [i, j] } else { [j, i] };
            place(names[i]).lerp(place(names[j]), heights[i] / (heights[i] - heights[j]))
        });
        let mut points = corners.chain(sides);
        let (p, q) = (points.next()?, points.next()?);
        Some(if p.dot(along) <= q.dot(along) { [p, q] } else { [q, p] })
    }
}

/// Whether light comes from outside of all surfaces.
fn is_under_sky(scene: &Scene) -> bool {
    !scene.sky.is_black() || scene.lights.iter().any(|light| light.kind == PointLightKind::Directional)
}

/// How much of a line in the plane of a triangle lies on it, or within a margin.
fn length_within([start, end]: [DVec3; 2], corners: [DVec3; 3], up: DVec3, margin: f64) -> f64 {
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for i in 0..3 {
        let inward = up.cross(corners[(i + 1) % 3] - corners[i]).normalize_or_zero();
        let [p, q] = [start, end].map(|end| (end - corners[i]).dot(inward) + margin);
        if p < 0.0 && q < 0.0 {
            return 0.0;
        } else if p < 0.0 {
            first = first.max(p / (p - q));
        } else if q < 0.0 {
            last = last.min(p / (p - q));
        }
    }
    (last - first) * start.distance(end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Sky, Up};
    use glam::DVec2;
    use std::collections::BTreeSet;

    fn scene(quads: &[[[f64; 3]; 4]]) -> Scene {
        let materials = vec![Material { double_sided: true, ..Material::default() }];
        let mut scene = Scene { materials, ..Scene::default() };
        for corners in quads {
            scene.add_quad("quad", 0, corners.map(DVec3::from));
        }
        scene
    }

    const FLOOR: [[f64; 3]; 4] = [[0., 0., 0.], [4., 0., 0.], [4., 3., 0.], [0., 3., 0.]];

    /// Thin beams are cut where they go through a ceiling behind which is the sky, on the edges of its triangles too; and light breaks there; not by floors, nor where they end in a solid.
    #[test]
    fn beams_are_cut_by_ceilings_before_the_sky() {
        let sky = || Sky::Uniform([1.0; 3]);
        let quads = |n: u32, up: bool| {
            let at = |i: u32, j: u32| [4.0 * f64::from(i) / f64::from(n), 3.0 * f64::from(j) / f64::from(n), 0.0];
            let quad = move |i, j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let all = (0..n).flat_map(move |i| (0..n).map(move |j| quad(i, j)));
            all.map(|[a, b, c, d]| if up { [a, b, c, d] } else { [d, c, b, a] }).collect::<Vec<_>>()
        };
        let slab = solid([0.0, 0.0, -0.5], [4.0, 3.0, 0.0]).to_vec();
        for (sheet, low, sky, is_cut) in [
            (quads(1, false), -1.0, sky(), true),
            (quads(200, false), -1.0, sky(), true),
            (quads(1, false), -1.0, Sky::Black, false),
            (quads(1, true), -1.0, sky(), false),
            (slab, -0.2, sky(), false),
        ] {
            // Beside the diagonal of the ceiling, and across it.
            for y in [1.0, 0.745] {
                let beam = solid([1.0, y, low], [1.03, y + 0.03, 1.0]);
                let mut scene = Scene { sky: sky.clone(), ..solids(&[&beam, &sheet[..]].concat()) };
                scene.up = Up::Z;
                let mesh = Mesh::new(&scene);
                let of_beam = |t: &usize| (mesh.source[*t] as usize) < 2 * beam.len();
                let goes_through = |t: usize| {
                    let heights = mesh.corners(t).map(|p| p.z);
                    heights.iter().any(|z| *z > 1e-3) && heights.iter().any(|z| *z < -1e-3)
                };
                let through = (0..mesh.triangles.len()).filter(of_beam).filter(|t| goes_through(*t)).count();
                assert_eq!(through, if is_cut { 0 } else { 8 }, "{} {low} {y}", sheet.len());
                // Below the cut and above it the beam has other smooth vertices: no light goes on from there.
                let on_side = |side: f64| -> BTreeSet<u32> {
                    let lies = |t: &usize| side * mesh.corners(*t).iter().map(|p| p.z).sum::<f64>() > 0.1;
                    let own = (0..mesh.triangles.len()).filter(of_beam).filter(lies);
                    let corners = own.flat_map(|t| (0..3).map(move |i| (t, i)));
                    corners
                        .filter(|(t, i)| mesh.corners(*t)[*i].z.abs() < 1e-5)
                        .map(|(t, i)| mesh.smooth[t][i])
                        .collect()
                };
                let [above, below] = [1.0, -1.0].map(on_side);
                assert!(above.is_disjoint(&below) && above.is_empty() != is_cut, "{above:?} {below:?}");
            }
        }
    }

    /// A wall, one high, from one point of the floor to another.
    fn wall([x, y]: [f64; 2], [u, v]: [f64; 2]) -> [[f64; 3]; 4] {
        [[x, y, 0.], [u, v, 0.], [u, v, 1.], [x, y, 1.]]
    }

    /// The mesh, after what must hold of any: every part of the scene is there once, points keep their place on it, and
    /// no vertex lies within an edge.
    fn checked(scene: &Scene) -> Mesh {
        let mesh = Mesh::new(scene);
        let mut area = vec![0.0; scene.triangles.len()];
        for t in 0..mesh.triangles.len() {
            area[mesh.source[t] as usize] += mesh.area(t);
            assert!(mesh.area(t) > 0.0);
            assert!(mesh.normal(t).dot(mesh_normal(scene, mesh.source[t] as usize)) > 0.999);
            for uv in [DVec2::new(0.3, 0.2), DVec2::ZERO, DVec2::X, DVec2::Y] {
                let at = mesh.surface(t, uv);
                let [a, b, c] = scene.corners(at.triangle);
                let there = a + at.uv.x * (b - a) + at.uv.y * (c - a);
                assert!(there.distance(mesh.point(t, uv)) < 2.0 * mesh.tolerance, "{there} {}", mesh.point(t, uv));
            }
        }
        for (t, area) in area.into_iter().enumerate() {
            assert!((area / scene.area(t) - 1.0).abs() < 1e-5, "{t}: {area} of {}", scene.area(t));
        }
        for corners in &mesh.triangles {
            for i in 0..3 {
                let [a, b] = [corners[i], corners[(i + 1) % 3]].map(|v| mesh.vertices[v as usize]);
                let used = mesh.triangles.iter().flatten().filter(|v| !corners.contains(v));
                for p in used.map(|v| mesh.vertices[*v as usize]) {
                    let share = (p - a).dot(b - a) / a.distance_squared(b);
                    let hangs = (0.0..=1.0).contains(&share) && p.distance(a.lerp(b, share)) < mesh.tolerance;
                    assert!(!hangs, "{p} on {a} {b}");
                }
            }
        }
        mesh
    }

    fn mesh_normal(scene: &Scene, t: usize) -> DVec3 {
        let [a, b, c] = scene.corners(t);
        (b - a).cross(c - a).normalize()
    }

    /// The smooth vertices of the floor (the first two triangles of the scene) that a place of it has.
    fn names_at(mesh: &Mesh, p: [f64; 3]) -> usize {
        let on_floor = (0..mesh.triangles.len()).filter(|t| mesh.source[*t] < 2);
        let corners = on_floor.flat_map(|t| (0..3).map(move |i| (t, i)));
        let here = corners.filter(|&(t, i)| mesh.corners(t)[i].distance(p.into()) < 1e-5);
        let mut names: Vec<u32> = here.map(|(t, i)| mesh.smooth[t][i]).collect();
        names.sort_unstable();
        names.dedup();
        names.len()
    }

    #[test]
    fn a_wall_across_one_polygon_cuts_it() {
        for turned in [false, true] {
            let mut floor = FLOOR;
            floor.rotate_left(usize::from(turned));
            let mesh = checked(&scene(&[floor, wall([2., 0.], [2., 3.])]));
            // The wall has two triangles and gets a vertex where the floor's diagonal is; so has each half of the floor three.
            assert_eq!(mesh.triangles.len(), 3 + 6);
            for y in [0.0, 1.5, 3.0] {
                assert_eq!(names_at(&mesh, [2., y, 0.]), 2);
            }
        }
    }

    #[test]
    fn an_oblique_wall_cuts_the_floor() {
        let mesh = checked(&scene(&[FLOOR, wall([0.3, 0.], [3.1, 3.])]));
        assert_eq!((names_at(&mesh, [0.3, 0., 0.]), names_at(&mesh, [3.1, 3., 0.])), (2, 2));
        // From corner to corner, along and across the diagonal.
        checked(&scene(&[FLOOR, wall([0., 0.], [4., 3.])]));
        let mesh = checked(&scene(&[FLOOR, wall([4., 0.], [0., 3.])]));
        assert_eq!(names_at(&mesh, [4., 0., 0.]), 2);
    }

    /// It separates nothing, but the edge of its shadow is an edge of the floor.
    #[test]
    fn a_wall_that_ends_within_the_floor_cuts_it_as_far() {
        let mesh = checked(&scene(&[FLOOR, wall([1., 2.], [2.5, 1.])]));
        assert!(mesh.is_split());
        assert_eq!((names_at(&mesh, [1., 2., 0.]), names_at(&mesh, [2.5, 1., 0.])), (1, 1));
    }

    #[test]
    fn walls_that_cross_or_meet_share_a_vertex() {
        let mesh = checked(&scene(&[FLOOR, wall([1., 0.], [1., 3.]), wall([0., 2.], [4., 2.])]));
        assert_eq!(names_at(&mesh, [1., 2., 0.]), 4);
        let mesh = checked(&scene(&[FLOOR, wall([1., 0.], [1., 3.]), wall([1., 2.], [4., 2.])]));
        assert_eq!(names_at(&mesh, [1., 2., 0.]), 3);
        // Short of it by what is one place.
        let mesh = checked(&scene(&[FLOOR, wall([1., 0.], [1., 3.]), wall([1. + 3e-6, 2.], [4., 2.])]));
        assert_eq!(names_at(&mesh, [1., 2., 0.]), 3);
    }

    #[test]
    fn a_subdivided_wall_divides_the_edge_below_it() {
        let left = [[0., 0., 0.], [2., 0., 0.], [2., 3., 0.], [0., 3., 0.]];
        let right = [[2., 0., 0.], [4., 0., 0.], [4., 3., 0.], [2., 3., 0.]];
        let tenth = |i: i32| 0.3 * f64::from(i);
        let mut quads = vec![left, right];
        quads.extend((0..10).map(|i| wall([2., tenth(i)], [2., tenth(i + 1)])));
        let mut scene = scene(&quads);
        let mesh = checked(&scene);
        assert_eq!(mesh.triangles.len(), 20 + 4 + 18);
        // The other way round: a wall in one piece on tiles.
        scene.objects.clear();
        quads = vec![wall([2., 0.], [2., 3.])];
        quads.extend((0..10).flat_map(|i| {
            let tile =
                |x: f64| [[x, tenth(i), 0.], [x + 2., tenth(i), 0.], [x + 2., tenth(i + 1), 0.], [x, tenth(i + 1), 0.]];
            [tile(0.), tile(2.)]
        }));
        let mesh = checked(&self::scene(&quads));
        assert_eq!(mesh.triangles.len(), 40 + 2 + 9);
    }

    /// Walls of one-sided faces back to back have no edge without a partner.
    #[test]
    fn walls_of_two_layers_cut_the_floor() {
        let mut back = wall([2., 0.], [2., 3.]);
        back.reverse();
        let mut scene = scene(&[FLOOR, wall([2., 0.], [2., 3.]), back]);
        scene.materials[0].double_sided = false;
        let mesh = checked(&scene);
        assert_eq!(mesh.triangles.len(), 6 + 3 + 3);
        assert_eq!(names_at(&mesh, [2., 1.5, 0.]), 2);
    }

    #[test]
    fn what_does_not_stand_does_not_cut() {
        let whole = |quads: &[[[f64; 3]; 4]]| {
            let mesh = checked(&scene(quads));
            assert_eq!(mesh.triangles.len(), 2 * quads.len());
        };
        // Above the floor, beside it, flat on it, and touching it with a corner.
        let lifted = |z: f64| wall([1., 1.], [3., 2.]).map(|[x, y, h]| [x, y, h + z]);
        whole(&[FLOOR, lifted(0.01)]);
        whole(&[FLOOR, wall([5., 0.], [5., 3.])]);
        whole(&[FLOOR, [[1., 1., 0.], [2., 1., 0.], [2., 2., 0.], [1., 2., 0.]]]);
        whole(&[FLOOR, [[1., 1., 0.], [2., 1., 1.], [2., 1., 2.], [1., 1., 1.]]]);
        // On the black back of the floor, and of glass.
        let mut below = scene(&[FLOOR, wall([2., 1.], [2., 2.]).map(|[x, y, z]| [x, y, -z])]);
        below.materials[0].double_sided = false;
        assert_eq!(checked(&below).triangles.len(), 4);
        let mut glass = scene(&[FLOOR, wall([2., 1.], [2., 2.])]);
        glass.materials[0].alpha_mode = AlphaMode::Blend;
        assert_eq!(checked(&glass).triangles.len(), 4);
    }

    /// Six faces from one corner to the other, outwards.
    fn solid([x, y, z]: [f64; 3], [u, v, w]: [f64; 3]) -> [[[f64; 3]; 4]; 6] {
        [
            [[x, y, z], [x, v, z], [u, v, z], [u, y, z]],
            [[x, y, w], [u, y, w], [u, v, w], [x, v, w]],
            [[x, y, z], [u, y, z], [u, y, w], [x, y, w]],
            [[u, y, z], [u, v, z], [u, v, w], [u, y, w]],
            [[u, v, z], [x, v, z], [x, v, w], [u, v, w]],
            [[x, v, z], [x, y, z], [x, y, w], [x, v, w]],
        ]
    }

    /// A scene of one-sided quads.
    fn solids(quads: &[[[f64; 3]; 4]]) -> Scene {
        let mut scene = scene(quads);
        scene.materials[0].double_sided = false;
        scene
    }

    /// The floor has other smooth vertices below the wall than beside it.
    #[test]
    fn a_closed_wall_cuts_the_floor_that_it_stands_on_or_goes_through() {
        for sunk in [0.0, 0.03] {
            let wall = solid([2., -sunk, -sunk], [2.1, 3. + sunk, 1.]);
            let mesh = checked(&solids(&[&[FLOOR][..], &wall].concat()));
            for x in [2.0, 2.1] {
                assert_eq!((names_at(&mesh, [x, 0., 0.]), names_at(&mesh, [x, 3., 0.])), (2, 2), "{sunk}");
            }
        }
    }

    #[test]
    fn a_sheet_through_the_floor_cuts_it_and_is_cut() {
        let through = wall([2., 0.], [2., 3.]).map(|[x, y, z]| [x, y, z - 0.03]);
        let half = |x: f64| [[x, 0., 0.], [x + 2., 0., 0.], [x + 2., 3., 0.], [x, 3., 0.]];
        // Across a floor in one piece, and along an edge of one in two.
        for quads in [vec![FLOOR, through], vec![half(0.), half(2.), through]] {
            let mesh = checked(&scene(&quads));
            let of_sheet = (0..mesh.triangles.len()).filter(|t| mesh.source[*t] as usize >= 2 * quads.len() - 2);
            let [above, below] = [1.0, -1.0].map(|side| {
                let within = |t: &usize| mesh.corners(*t).iter().all(|p| side * p.z > -1e-5);
                of_sheet.clone().filter(within).map(|t| mesh.area(t)).sum::<f64>()
            });
            assert!((above - 2.91).abs() < 1e-4 && (below - 0.09).abs() < 1e-4, "{above} {below}");
        }
    }

    /// Table legs, whose feet are shorter than an element; a pile of planks; the corner of a box in another.
    #[test]
    fn what_parts_nothing_does_not_cut() {
        let whole = |quads: &[[[f64; 3]; 4]]| assert_eq!(checked(&solids(quads)).triangles.len(), 2 * quads.len());
        whole(&[&[FLOOR][..], &solid([1., 1., 0.], [1.03, 1.03, 1.])].concat());
        whole(&[&[FLOOR][..], &solid([1., 1., -0.1], [1.03, 1.03, 1.])].concat());
        let pile: Vec<_> = (0..6).flat_map(|i| solid([0., 0., f64::from(i)], [4., 3., f64::from(i + 1)])).collect();
        whole(&[&[FLOOR][..], &pile].concat());
        whole(&[solid([0., 0., 0.], [2., 2., 2.]), solid([1., 1., 1.], [3., 3., 3.])].concat());
    }

    /// A grid of sheets, each of which goes through all across it, has more contacts than are looked for; that is told.
    #[test]
    fn what_stays_uncut_is_told() {
        let grid = |n: u32| {
            let along = |i: u32| 4.0 * (f64::from(i) + 0.5) / f64::from(n);
            let sheets = |i| [wall([along(i), 0.], [along(i), 4.]), wall([0., along(i)], [4., along(i)])];
            Mesh::new(&scene(&(0..n).flat_map(sheets).collect::<Vec<_>>()))
        };
        assert!(!grid(10).uncut);
        assert!(grid(200).uncut);
    }

    /// Walls at all angles and places, near each other and the floor's edges by less than is told apart, and slivers.
    #[test]
    fn any_walls_leave_a_whole_floor() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        for round in 0..200 {
            let mut quads = vec![FLOOR];
            let mut last = [1.0, 1.0];
            for _ in 0..1 + round % 8 {
                let mut end =
                    || [5.0 * random() - 0.5, 4.0 * random() - 0.5].map(|x| if random() < 0.3 { x.round() } else { x });
                let (from, to) = (end(), end());
                let jitter = 1e-5 * (random() - 0.5);
                let from = if random() < 0.4 { [last[0] + jitter, last[1] - jitter] } else { from };
                if (from[0] - to[0]).abs() + (from[1] - to[1]).abs() > 1e-3 {
                    quads.push(wall(from, to));
                }
                last = to;
            }
            let scene = scene(&quads);
            let mesh = Mesh::new(&scene);
            let floor = (0..mesh.triangles.len()).filter(|t| mesh.source[*t] < 2);
            let area: f64 = floor.map(|t| mesh.area(t)).sum();
            assert!((area - 12.0).abs() < 1e-4, "{round}: {area}");
        }
    }
}
