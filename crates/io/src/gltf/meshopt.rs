//! Decoders of EXT_meshopt_compression and KHR_meshopt_compression (their specifications, appendix A and B).
//!
//! Written here because the maintained crate binds C++, and hostile input must not reach C++. The result has exactly
//! the size that was asked for, or decoding fails.

/// How a view is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    /// Vertices: byte deltas by column.
    Attributes,
    /// Triangle lists by shared edges.
    Triangles,
    /// Any sequence of indices.
    Indices,
}

/// What is done to decoded vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// Most output bytes per input byte, with room: a block of 256 vertices of zeros takes one byte per four columns.
pub(crate) const MAX_RATIO: usize = 1100;

/// Decodes `count` elements of `stride` bytes.
pub(crate) fn decode(data: &[u8], count: usize, stride: usize, mode: Mode, filter: Filter) -> Result<Vec<u8>, String> {
    let size = count.checked_mul(stride).filter(|size| *size <= data.len().saturating_mul(MAX_RATIO));
    let size = size.ok_or_else(|| format!("{count} elements of {stride} bytes from {} bytes", data.len()))?;
    let decoded = match mode {
        Mode::Attributes if stride.is_multiple_of(4) && (4..=256).contains(&stride) => {
            vertices(data, count, stride).map(|mut bytes| unfilter(&mut bytes, stride, filter).map(|()| bytes))
        }
        Mode::Triangles if matches!(stride, 2 | 4) && count.is_multiple_of(3) => {
            triangles(data, count).map(|indices| Ok(packed(&indices, stride)))
        }
        Mode::Indices if matches!(stride, 2 | 4) => sequence(data, count).map(|indices| Ok(packed(&indices, stride))),
        _ => return Err(format!("{mode:?} of {count} elements of {stride} bytes")),
    };
    let decoded = decoded.ok_or("the compressed data are damaged")??;
    if decoded.len() == size { Ok(decoded) } else { Err("the compressed data are damaged".to_owned()) }
}

fn packed(indices: &[u32], stride: usize) -> Vec<u8> {
    match stride {
        2 => indices.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect(),
        _ => indices.iter().flat_map(|&i| i.to_le_bytes()).collect(),
    }
}

/// Bytes taken one after the other from the front.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn byte(&mut self) -> Option<u8> {
        let (&first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(first)
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    /// Up to five groups of seven bits, lowest first.
    fn varint(&mut self) -> Option<u32> {
        let mut value = 0_u32;
        for group in 0..5 {
            let byte = self.byte()?;
            value |= u32::from(byte & 127) << (7 * group);
            if byte < 128 {
                break;
            }
        }
        Some(value)
    }

    /// A zigzag difference to `last`.
    fn index(&mut self, last: u32) -> Option<u32> {
        let v = self.varint()?;
        Some(last.wrapping_add(unzigzag(v)))
    }
}

fn unzigzag(v: u32) -> u32 {
    (v >> 1) ^ (v & 1).wrapping_neg()
}

fn vertices(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let (&header, body) = data.split_first()?;
    let version = match header {
        0xa0 => 0,
        0xa1 => 1,
        _ => return None,
    };
    // The tail: the first vertex and, from version 1 on, how each group of four columns is coded; padded in front.
    let tail_size = if version == 0 { stride } else { stride + stride / 4 };
    let padded = tail_size.max(if version == 0 { 32 } else { 24 });
    let (body, tail) = body.split_at_checked(body.len().checked_sub(padded)?)?;
    let tail = tail.get(padded - tail_size..)?;
    let (first, channels) = tail.split_at_checked(stride)?;
    let mut last = first.to_vec();

    let mut reader = Reader(body);
    let mut out = vec![0; count * stride];
    let block = ((8192 / stride) & !15).min(256);
    let mut columns = vec![0; 4 * 256];
    for rows in out.chunks_mut(block * stride) {
        let vertices = rows.len() / stride;
        let control = if version == 0 { &[] } else { reader.take(stride / 4)? };
        for group in 0..stride / 4 {
            for column in 0..4 {
                let bytes = columns.get_mut(column * 256..column * 256 + vertices)?;
                let code = control.get(group).map(|byte| (byte >> (2 * column)) & 3);
                match code {
                    Some(3) => bytes.copy_from_slice(reader.take(vertices)?),
                    Some(2) => bytes.fill(0),
                    Some(1) => column_of_bytes(&mut reader, bytes, [1, 2, 4, 8])?,
                    Some(_) => column_of_bytes(&mut reader, bytes, [0, 1, 2, 4])?,
                    None => column_of_bytes(&mut reader, bytes, [0, 2, 4, 8])?,
                }
            }
            let channel = channels.get(group).copied().unwrap_or(0);
            let last = last.get_mut(4 * group..4 * group + 4)?;
            let column = |k: usize, vertex: usize| columns.get(256 * k + vertex).copied().unwrap_or_default();
            for (vertex, row) in rows.chunks_exact_mut(stride).enumerate() {
                let target = row.get_mut(4 * group..4 * group + 4)?;
                let given: [u8; 4] = std::array::from_fn(|k| column(k, vertex));
                let before: [u8; 4] = std::array::from_fn(|k| last.get(k).copied().unwrap_or_default());
                let now = match channel & 3 {
                    0 => std::array::from_fn(|k| {
                        let v = given[k];
                        ((v >> 1) ^ (v & 1).wrapping_neg()).wrapping_add(before[k])
                    }),
                    1 => {
                        let half = |k: usize| {
                            let v = u16::from_le_bytes([given[k], given[k + 1]]);
                            let p = u16::from_le_bytes([before[k], before[k + 1]]);
                            ((v >> 1) ^ (v & 1).wrapping_neg()).wrapping_add(p).to_le_bytes()
                        };
                        let ([a, b], [c, d]) = (half(0), half(2));
                        [a, b, c, d]
                    }
                    2 => {
                        let turned = u32::from_le_bytes(given).rotate_right(u32::from(channel >> 4));
                        (turned ^ u32::from_le_bytes(before)).to_le_bytes()
                    }
                    _ => return None,
                };
                target.copy_from_slice(&now);
                last.copy_from_slice(&now);
            }
        }
    }
    reader.0.is_empty().then_some(out)
}

/// One column of a block: groups of 16 with 2 bits each that choose the width of their values.
fn column_of_bytes(reader: &mut Reader<'_>, out: &mut [u8], widths: [u32; 4]) -> Option<()> {
    let groups = out.len().div_ceil(16);
    let header = reader.take(groups.div_ceil(4))?;
    for (group, values) in out.chunks_mut(16).enumerate() {
        let choice = (header.get(group / 4)? >> (2 * (group % 4))) & 3;
        let bits = *widths.get(usize::from(choice))?;
        // A group is always 16 values in the stream, also where the block ends before.
        let mut all = [0_u8; 16];
        match bits {
            0 => {}
            8 => all.copy_from_slice(reader.take(16)?),
            _ => {
                let packed = reader.take(2 * bits as usize)?;
                let sentinel = ((1_u32 << bits) - 1) as u8;
                let per_byte = (8 / bits) as usize;
                for (i, slot) in all.iter_mut().enumerate() {
                    let byte = *packed.get(i / per_byte)?;
                    let within = (i % per_byte) as u32;
                    // First value in the highest bits, except single bits, which begin with the lowest.
                    let shift = if bits == 1 { within } else { 8 - bits * (within + 1) };
                    *slot = (byte >> shift) & sentinel;
                }
                // Values that did not fit follow whole.
                for slot in all.iter_mut().filter(|slot| **slot == sentinel) {
                    *slot = reader.byte()?;
                }
            }
        }
        values.copy_from_slice(all.get(..values.len())?);
    }
    Some(())
}

/// The last 16 edges and vertices, by which triangles refer to what was before.
struct Fifos {
    edges: [[u32; 2]; 16],
    edge_at: usize,
    vertices: [u32; 16],
    vertex_at: usize,
}

impl Fifos {
    fn edge(&self, back: usize) -> [u32; 2] {
        self.edges[self.edge_at.wrapping_sub(1 + back) & 15]
    }

    fn vertex(&self, back: usize) -> u32 {
        self.vertices[self.vertex_at.wrapping_sub(back) & 15]
    }

    fn push_edge(&mut self, a: u32, b: u32) {
        self.edges[self.edge_at] = [a, b];
        self.edge_at = (self.edge_at + 1) & 15;
    }

    fn push_vertex(&mut self, vertex: u32, keep: bool) {
        self.vertices[self.vertex_at] = vertex;
        self.vertex_at = (self.vertex_at + usize::from(keep)) & 15;
    }
}

fn triangles(data: &[u8], count: usize) -> Option<Vec<u32>> {
    let (&header, body) = data.split_first()?;
    // Version 0 exists in the library but not in the extension; it differs only in the codes 13 and 14.
    let most_known = match header {
        0xe0 => 15,
        0xe1 => 13,
        _ => return None,
    };
    let (codes, rest) = body.split_at_checked(count / 3)?;
    let (rest, table) = rest.split_at_checked(rest.len().checked_sub(16)?)?;
    let mut reader = Reader(rest);
    let none = u32::MAX;
    let mut fifos = Fifos { edges: [[none; 2]; 16], edge_at: 0, vertices: [none; 16], vertex_at: 0 };
    let (mut next, mut last) = (0_u32, 0_u32);
    let mut out = Vec::with_capacity(count);
    fn fresh(next: &mut u32) -> u32 {
        let index = *next;
        *next = next.wrapping_add(1);
        index
    }

    for &code in codes {
        if code < 0xf0 {
            // A known edge and a third vertex: new, known, or given.
            let [a, b] = fifos.edge(usize::from(code >> 4));
            let third = code & 15;
            let c = if third == 0 {
                fresh(&mut next)
            } else if third < most_known {
                fifos.vertex(1 + usize::from(third))
            } else {
                last = match third {
                    13 => last.wrapping_sub(1),
                    14 => last.wrapping_add(1),
                    _ => reader.index(last)?,
                };
                last
            };
            fifos.push_vertex(c, third == 0 || third >= most_known);
            fifos.push_edge(c, b);
            fifos.push_edge(a, c);
            out.extend([a, b, c]);
            continue;
        }
        // No known edge: each vertex is new, known, or given.
        let (first, others) = match code {
            0xfe | 0xff => {
                let others = reader.byte()?;
                if others == 0 {
                    next = 0;
                }
                (if code == 0xfe { 0 } else { 15 }, others)
            }
            _ => (0, *table.get(usize::from(code & 15))?),
        };
        let (second, third) = (others >> 4, others & 15);
        // A table entry never gives a vertex; one that claims to is read as a known one.
        let given = |slot: u8| slot == 15 && code >= 0xfe;
        let mut a = if first == 0 { fresh(&mut next) } else { 0 };
        let mut b = if second == 0 { fresh(&mut next) } else { fifos.vertex(usize::from(second)) };
        let mut c = if third == 0 { fresh(&mut next) } else { fifos.vertex(usize::from(third)) };
        for (slot, vertex) in [(first, &mut a), (second, &mut b), (third, &mut c)] {
            if given(slot) {
                last = reader.index(last)?;
                *vertex = last;
            }
        }
        fifos.push_vertex(a, true);
        fifos.push_vertex(b, second == 0 || given(second));
        fifos.push_vertex(c, third == 0 || given(third));
        fifos.push_edge(b, a);
        fifos.push_edge(c, b);
        fifos.push_edge(a, c);
        out.extend([a, b, c]);
    }
    reader.0.is_empty().then_some(out)
}

fn sequence(data: &[u8], count: usize) -> Option<Vec<u32>> {
    let (&header, body) = data.split_first()?;
    if !matches!(header, 0xd0 | 0xd1) {
        return None;
    }
    // Four bytes of padding end the stream.
    let mut reader = Reader(body.get(..body.len().checked_sub(4)?)?);
    let mut last = [0_u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let v = reader.varint()?;
        let slot = last.get_mut((v & 1) as usize)?;
        *slot = slot.wrapping_add(unzigzag(v >> 1));
        out.push(*slot);
    }
    reader.0.is_empty().then_some(out)
}

fn unfilter(bytes: &mut [u8], stride: usize, filter: Filter) -> Result<(), String> {
    let fits = match filter {
        Filter::None => return Ok(()),
        Filter::Octahedral | Filter::Color => matches!(stride, 4 | 8),
        Filter::Quaternion => stride == 8,
        Filter::Exponential => stride.is_multiple_of(4),
    };
    if !fits {
        return Err(format!("filter {filter:?} on elements of {stride} bytes"));
    }
    if filter == Filter::Exponential {
        for word in bytes.chunks_exact_mut(4) {
            let v = i32::from_le_bytes([word[0], word[1], word[2], word[3]]);
            let (mantissa, exponent) = ((v << 8) >> 8, v >> 24);
            word.copy_from_slice(&((f64::from(mantissa) * 2.0_f64.powi(exponent)) as f32).to_le_bytes());
        }
        return Ok(());
    }
    for element in bytes.chunks_exact_mut(stride) {
        let wide = stride == 8;
        let signed: [i32; 4] = std::array::from_fn(|i| match wide {
            true => i32::from(i16::from_le_bytes([element[2 * i], element[2 * i + 1]])),
            false => i32::from(element[i] as i8),
        });
        let decoded = match filter {
            Filter::Octahedral => octahedral(signed, if wide { 32767.0 } else { 127.0 }),
            Filter::Quaternion => quaternion(signed),
            _ => color(signed, wide),
        };
        for (i, value) in decoded.into_iter().enumerate() {
            match wide {
                true => element[2 * i..2 * i + 2].copy_from_slice(&(value as u16).to_le_bytes()),
                false => element[i] = value as u8,
            }
        }
    }
    Ok(())
}

fn rounded(x: f32) -> i32 {
    (x + if x >= 0.0 { 0.5 } else { -0.5 }) as i32
}

fn octahedral([x, y, one, w]: [i32; 4], most: f32) -> [i32; 4] {
    let (mut x, mut y) = (x as f32, y as f32);
    let z = one as f32 - x.abs() - y.abs();
    let fold = z.min(0.0);
    x += if x >= 0.0 { fold } else { -fold };
    y += if y >= 0.0 { fold } else { -fold };
    let scale = most / (x * x + y * y + z * z).sqrt();
    [rounded(x * scale), rounded(y * scale), rounded(z * scale), w]
}

fn quaternion([a, b, c, d]: [i32; 4]) -> [i32; 4] {
    // The fourth number carries the scale, and in its lowest bits which component was left out.
    let scale = std::f32::consts::FRAC_1_SQRT_2 / (d | 3) as f32;
    let given = [a, b, c].map(|v| v as f32 * scale);
    let rest = (1.0 - given.iter().map(|v| v * v).sum::<f32>()).max(0.0).sqrt();
    let left_out = (d & 3) as usize;
    let mut out = [0; 4];
    out[left_out] = (rest * 32767.0 + 0.5) as i32;
    for (i, v) in given.into_iter().enumerate() {
        out[(left_out + 1 + i) & 3] = rounded(v * 32767.0);
    }
    out
}

/// YCoCg with a scale that alpha's highest bit tells.
fn color([y, co, cg, a]: [i32; 4], wide: bool) -> [i32; 4] {
    let most = if wide { 0xffff } else { 0xff };
    let (y, a) = (y & most, a & most);
    let mut scale = a;
    for shift in [1, 2, 4, 8] {
        scale |= scale >> shift;
    }
    let alpha = ((a << 1) & scale) | (a & 1);
    let factor = most as f32 / scale as f32;
    let out = [y + co - cg, y + cg, y - co - cg, alpha];
    out.map(|v| (v as f32 * factor + 0.5) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(hex: &str) -> Vec<u8> {
        (0..hex.len() / 2).map(|i| u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).unwrap()).collect()
    }

    /// The streams of these tests were written by the reference encoder (meshoptimizer, through crate meshopt 0.7).
    #[test]
    fn both_versions_of_vertices_decode_to_the_same() {
        let vertices: Vec<u8> = (0..40_u32)
            .flat_map(|i| {
                let [a, b] = [(300 + 3 * i) as u16, 65000_u32.wrapping_add(5 * i) as u16].map(u16::to_le_bytes);
                [a[0], a[1], b[0], b[1], (i * i % 7) as u8, 9, (i % 2 * 200) as u8, 0]
            })
            .collect();
        let version_0 = "a02a066666666666666666666666666666666666666600000000002a0aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\
            0000000001002000002a026304512630451263045126304512630451263000000000001f006f706f706f706f706f706f\
            706f706f706f706f706f706f706f706f706f706fffff0000706f706f706f706f00000000000000000000000000000000\
            0000000000000000002c01e8fd00090000";
        let version_1 = "a199b92a0666666666666666666666666666666666666666000000002a0aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\
            aa000000002a026304512630451263045126304512630451263000000000006f706f706f706f706f706f706f706f706f\
            706f706f706f706f706f706f706f706f706f706f706f00000000000000000000000000002c01e8fd000900000100";
        for stream in [version_0, version_1] {
            assert_eq!(decode(&bytes(stream), 40, 8, Mode::Attributes, Filter::None).unwrap(), vertices);
        }
    }

    #[test]
    fn turned_words_and_both_kinds_of_index_decode() {
        let floats = "a16a05155555555500000000000000000000000000000000000000000000cdcccc3d01";
        let expected: Vec<u8> = (0..20).flat_map(|i| (0.1_f32 * (i as f32).exp2()).to_le_bytes()).collect();
        assert_eq!(decode(&bytes(floats), 20, 4, Mode::Attributes, Filter::None).unwrap(), expected);

        let indices = [0, 1, 2, 2, 1, 3, 100, 7, 100, 4, 5, 6];
        let expected: Vec<u8> = indices.into_iter().flat_map(u32::to_le_bytes).collect();
        let sequence = bytes("d1000404000208910310010a040400000000");
        assert_eq!(decode(&sequence, 12, 4, Mode::Indices, Filter::None).unwrap(), expected);
        let triangles = bytes("e1f010fff0ffc801b901ba01007687566778a9866589689801690000");
        assert_eq!(decode(&triangles, 12, 4, Mode::Triangles, Filter::None).unwrap(), expected);
    }

    #[test]
    fn filters_give_back_what_was_filtered() {
        assert_eq!(quaternion([1447, 1447, 1447, 2044]), [16399, 16378, 16378, 16378]);
        assert_eq!(quaternion([0, -1737, 0, 2047]), [0, -19661, 0, 26213]);
        assert_eq!(octahedral([127, 73, 127, 127], 127.0), [76, 0, -102, 127]);
        assert_eq!(color([127, 127, 0, 255], false), [254, 127, 0, 255]);
        assert_eq!(color([102, -51, 0, 128], false), [51, 102, 153, 0]);
        let mut word = 0xf500_0600_u32.to_le_bytes();
        unfilter(&mut word, 4, Filter::Exponential).unwrap();
        assert_eq!(f32::from_le_bytes(word), 0.75);
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let sequence = bytes("d1000404000208910310010a040400000000");
        for (count, stride, mode) in [
            (11, 4, Mode::Indices),
            (13, 4, Mode::Indices),
            (12, 3, Mode::Indices),
            (usize::MAX, 4, Mode::Indices),
            (12, 4, Mode::Triangles),
            (12, 4, Mode::Attributes),
            (1 << 20, 4, Mode::Attributes),
            (0, 0, Mode::Attributes),
        ] {
            assert!(decode(&sequence, count, stride, mode, Filter::None).is_err(), "{count} {stride} {mode:?}");
        }
    }
}
