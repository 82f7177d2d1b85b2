// The item buffer on graphics hardware: which polygon is nearest at the centre of each cell.

struct Seen {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) plane: vec3f,
    @location(1) @interpolate(flat) polygon: u32,
}

struct Cell {
    @location(0) polygon: u32,
    @builtin(frag_depth) nearness: f32,
}

// Corners come projected, in homogeneous coordinates.
@vertex
fn project(@location(0) corner: vec4f, @location(1) plane: vec3f, @location(2) polygon: u32) -> Seen {
    return Seen(corner, plane, polygon);
}

// Reciprocal depth is linear over the cells: taken from the polygon's plane, it does not depend on how the polygon was clipped.
@fragment
fn show(seen: Seen) -> Cell {
    return Cell(seen.polygon, dot(seen.plane, vec3f(seen.at.xy, 1.0)));
}
