//! Rectangles onto pages: skyline, lowest first (Jylänki 2010, "A thousand ways to pack the bin", section 3), with
//! the gaps that get buried under the skyline kept in a list and filled by later, smaller rectangles.

use std::cmp::Reverse;

/// Where a rectangle went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Placement {
    pub page: u32,
    pub x: u32,
    pub y: u32,
    /// Width and height are swapped.
    pub rotated: bool,
}

/// Gaps remembered for each page. Each later rectangle looks at all of them; with 2,000 a page of 20,000 tiny charts
/// still packs in a fraction of a second and no measurable area is lost.
const MOST_GAPS: usize = 2000;

/// Places rectangles (each side at most `max_page`) with `padding` free texels between any two. Also returns the
/// pages' sizes: as near to square as the rectangles allow, whole multiples of 4 (the block of compressed formats)
/// unless `max_page` is smaller.
pub(super) fn pack(sizes: &[[u32; 2]], max_page: u32, padding: u32) -> (Vec<Placement>, Vec<[u32; 2]>) {
    let mut places = vec![Placement::default(); sizes.len()];
    let mut pages = Vec::new();
    let mut left: Vec<u32> = (0..sizes.len() as u32).collect();
    left.sort_by_key(|&i| {
        let [w, h] = sizes[i as usize];
        (Reverse(w.max(h)), Reverse(w.min(h)), i)
    });
    while !left.is_empty() {
        // Every rectangle carries its padding on the right and below; the page's last padding is cut off.
        let padded = |i: u32| sizes[i as usize].map(|side| u64::from(side + padding));
        let area: u64 = left.iter().map(|&i| padded(i)[0] * padded(i)[1]).sum();
        let widest = left.iter().map(|&i| sizes[i as usize].into_iter().max().unwrap_or(1)).max().unwrap_or(1);
        let side = ((area as f64).sqrt().ceil()).min(f64::from(max_page)) as u32;
        let width = side.max(widest).next_multiple_of(4).min(max_page);
        let mut page = Page::new(width + padding, max_page + padding);
        let mut rest = Vec::new();
        let mut full = None;
        for &i in &left {
            // What did not fit once will not fit a second time, nor will anything larger.
            let size = padded(i).map(|side| side as u32);
            let hopeless = full
                .is_some_and(|[w, h]: [u32; 2]| size[0].min(size[1]) >= w.min(h) && size[0].max(size[1]) >= w.max(h));
            match (!hopeless).then(|| page.place(size)).flatten() {
                Some((x, y, rotated)) => {
                    places[i as usize] = Placement { page: pages.len() as u32, x, y, rotated };
                }
                None => {
                    full = Some(size);
                    rest.push(i);
                }
            }
        }
        let height = page.used.saturating_sub(padding).next_multiple_of(4).min(max_page);
        pages.push([width, height]);
        left = rest;
    }
    (places, pages)
}

struct Page {
    width: u32,
    height: u32,
    used: u32,
    /// Start and height of each step from left to right.
    skyline: Vec<[u32; 2]>,
    /// Buried free rectangles: x, y, width, height.
    gaps: Vec<[u32; 4]>,
}

impl Page {
    fn new(width: u32, height: u32) -> Page {
        Page { width, height, used: 0, skyline: vec![[0, 0]], gaps: Vec::new() }
    }

    /// Corner and rotation; `None` where there is no room.
    fn place(&mut self, size: [u32; 2]) -> Option<(u32, u32, bool)> {
        if let Some(found) = self.place_in_gap(size) {
            return Some(found);
        }
        // Lowest top first, then leftmost; upright before rotated.
        let mut best: Option<(u32, u32, bool, usize)> = None;
        let turned = [size[1], size[0]];
        for (rotated, [w, h]) in [(false, size), (true, turned)] {
            if rotated && w == h {
                continue;
            }
            for start in 0..self.skyline.len() {
                let Some(y) = self.rest(start, w) else { break };
                if y + h <= self.height && best.is_none_or(|(top, ..)| y + h < top) {
                    best = Some((y + h, y, rotated, start));
                }
            }
        }
        let (top, y, rotated, start) = best?;
        let w = if rotated { size[1] } else { size[0] };
        let x = self.skyline[start][0];
        self.bury(start, x, w, y, top);
        self.used = self.used.max(top);
        Some((x, y, rotated))
    }

    /// Height at which a rectangle of width `w` comes to rest on the step `start`; `None` past the right side.
    fn rest(&self, start: usize, w: u32) -> Option<u32> {
        let x = self.skyline[start][0];
        if x + w > self.width {
            return None;
        }
        let steps = self.skyline[start..].iter().take_while(|step| step[0] < x + w);
        steps.map(|step| step[1]).max()
    }

    /// Raises the skyline over x..x+w to `top` and remembers the gaps below `y`.
    fn bury(&mut self, start: usize, x: u32, w: u32, y: u32, top: u32) {
        let mut end = start;
        let mut level = 0;
        while end < self.skyline.len() && self.skyline[end][0] < x + w {
            let [from, height] = self.skyline[end];
            let to = self.skyline.get(end + 1).map_or(self.width, |step| step[0]);
            level = height;
            if height < y && self.gaps.len() < MOST_GAPS {
                self.gaps.push([from, height, to.min(x + w) - from, y - height]);
            }
            end += 1;
        }
        let mut steps = vec![[x, top]];
        let next = self.skyline.get(end).map_or(self.width, |step| step[0]);
        if x + w < next {
            steps.push([x + w, level]);
        }
        self.skyline.splice(start..end, steps);
        self.skyline.dedup_by(|right, left| right[1] == left[1]);
    }

    fn place_in_gap(&mut self, size: [u32; 2]) -> Option<(u32, u32, bool)> {
        let mut best: Option<(u64, usize, bool)> = None;
        for (index, &[.., w, h]) in self.gaps.iter().enumerate() {
            let upright = size[0] <= w && size[1] <= h;
            if upright || size[1] <= w && size[0] <= h {
                let waste = u64::from(w) * u64::from(h);
                if best.is_none_or(|(least, ..)| waste < least) {
                    best = Some((waste, index, !upright));
                }
            }
        }
        let (_, index, rotated) = best?;
        let [w, h] = if rotated { [size[1], size[0]] } else { size };
        let [x, y, width, height] = self.gaps.swap_remove(index);
        // The rest of the gap is cut along the longer remainder.
        let (beside, below) = (width - w, height - h);
        let pieces = if beside > below {
            [[x + w, y, beside, height], [x, y + h, w, below]]
        } else {
            [[x + w, y, beside, h], [x, y + h, width, below]]
        };
        self.gaps.extend(pieces.into_iter().filter(|piece| piece[2] > 0 && piece[3] > 0));
        Some((x, y, rotated))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(count: usize, largest: u32) -> Vec<[u32; 2]> {
        // Multiplicative congruential numbers (Park & Miller 1988), skewed to small sides.
        let mut state = 12345_u64;
        let mut next = || {
            state = state * 48271 % 2_147_483_647;
            let u = state as f64 / 2_147_483_647.0;
            1 + (u * u * u * f64::from(largest)) as u32
        };
        (0..count).map(|_| [next(), next()]).collect()
    }

    #[test]
    fn rectangles_keep_their_distance() {
        for (max_page, padding) in [(256, 0), (256, 2), (90, 5), (4096, 1)] {
            let sizes = sizes(800, 60);
            let (places, pages) = pack(&sizes, max_page, padding);
            let mut taken: Vec<Vec<bool>> =
                pages.iter().map(|[w, h]| vec![false; ((w + padding) * (h + padding)) as usize]).collect();
            for (size, place) in sizes.iter().zip(&places) {
                let [w, h] = if place.rotated { [size[1], size[0]] } else { *size };
                let [width, height] = pages[place.page as usize];
                assert!(width <= max_page && height <= max_page);
                assert!(place.x + w <= width && place.y + h <= height, "{place:?} of {w}x{h} in {width}x{height}");
                for y in place.y..place.y + h + padding {
                    for x in place.x..place.x + w + padding {
                        let cell = &mut taken[place.page as usize][(y * (width + padding) + x) as usize];
                        assert!(!*cell, "{x},{y} is taken twice");
                        *cell = true;
                    }
                }
            }
        }
    }

    #[test]
    fn tiny_rectangles_pack_tightly() {
        for sizes in [vec![[2, 2]; 20_000], vec![[1, 7]; 5000], sizes(5000, 40)] {
            let (_, pages) = pack(&sizes, 4096, 2);
            let used: u64 = sizes.iter().map(|[w, h]| u64::from((w + 2) * (h + 2))).sum();
            let area: u64 = pages.iter().map(|[w, h]| u64::from(w * h)).sum();
            assert!(used as f64 > 0.93 * area as f64, "{used} of {area}: {pages:?}");
        }
    }

    #[test]
    fn nothing_gives_no_page() {
        assert_eq!(pack(&[], 64, 2), (vec![], vec![]));
    }
}
