//! A graphics device that fills faces with the numbers of polygons.

use super::GpuError;
use crate::row::face::Face;
use crate::row::scan::{NONE, Scans};
use crate::row::surface::Raster;
use glam::DVec3;
use std::fmt;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::task::{Context, Poll, Waker};

/// The front of a wall without thickness is seen and not its back, which is taken to lie this much further away. In single
/// precision planes seen obliquely are off by some 1e-6; half as much would show backs at grazing angles. Walls thinner than
/// 15 µm for each metre that they are away count as without thickness.
const BACK: f64 = 1.0 / (1u32 << 16) as f64;

/// Triangles drawn at a time: 3 MB on their way, for each thread.
const PORTION: usize = 1 << 15;

/// Bytes of a corner: its place (4 numbers), its polygon's plane (3) and number.
const CORNER: usize = 32;

/// Bytes that rows of a copy are a multiple of, as wgpu has it.
const ALIGNED: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

const ITEMS: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
const DEPTHS: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// An open device. Threads share it; each draws on a canvas of its own.
pub(super) struct Device {
    name: String,
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    idle: Mutex<Vec<Canvas>>,
    failure: Arc<OnceLock<String>>,
}

/// What a face of some size is drawn on.
struct Canvas {
    cells: [usize; 2],
    items: wgpu::Texture,
    depths: wgpu::Texture,
    corners: wgpu::Buffer,
    copy: wgpu::Buffer,
}

impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Device").field("name", &self.name).finish_non_exhaustive()
    }
}

/// The result of a future that needs nobody to wake it, as wgpu's on native systems.
fn now<T>(future: impl Future<Output = T>) -> T {
    let mut future = std::pin::pin!(future);
    loop {
        if let Poll::Ready(value) = future.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            return value;
        }
        std::thread::yield_now();
    }
}

impl Device {
    /// Opens the fastest adapter that there is.
    pub fn open() -> Result<Device, GpuError> {
        Device::of(wgpu::Backends::all())
    }

    /// Opens the fastest adapter of some interfaces.
    pub fn of(backends: wgpu::Backends) -> Result<Device, GpuError> {
        let descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor { backends, ..descriptor });
        let wanted = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let adapter = now(instance.request_adapter(&wanted)).map_err(|e| GpuError::NoAdapter(e.to_string()))?;
        let name = adapter.get_info().name;
        let descriptor =
            wgpu::DeviceDescriptor { required_limits: wgpu::Limits::downlevel_defaults(), ..Default::default() };
        let opened = now(adapter.request_device(&descriptor));
        let (device, queue) = opened.map_err(|e| GpuError::Refused { adapter: name.clone(), why: e.to_string() })?;
        // Without these wgpu ends the program.
        let failure = Arc::new(OnceLock::new());
        let heard = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| drop(heard.set(error.to_string()))));
        let heard = Arc::clone(&failure);
        device.set_device_lost_callback(move |_, why| drop(heard.set(why)));
        let pipeline = pipeline(&device);
        Ok(Device { name, device, queue, pipeline, idle: Mutex::default(), failure })
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// What went wrong so far.
    pub fn failure(&self) -> Option<GpuError> {
        self.failure.get().map(|why| GpuError::Failed { adapter: self.name.clone(), why: why.clone() })
    }

    /// One that no thread draws on now, or a new one.
    fn canvas(&self, cells: [usize; 2]) -> Canvas {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        match idle.iter().position(|canvas| canvas.cells == cells) {
            Some(index) => idle.swap_remove(index),
            None => Canvas::new(&self.device, cells),
        }
    }

    /// Draws triangles over what is there; over nothing the first time.
    fn draw(&self, canvas: &Canvas, corners: &[u8], is_first: bool) {
        self.queue.write_buffer(&canvas.corners, 0, corners);
        let [items, depths] = [&canvas.items, &canvas.depths].map(|t| t.create_view(&Default::default()));
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let clear = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let store = wgpu::StoreOp::Store;
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &items,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: if is_first { clear } else { wgpu::LoadOp::Load }, store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depths,
                depth_ops: Some(wgpu::Operations {
                    load: if is_first { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load },
                    store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_vertex_buffer(0, canvas.corners.slice(..));
        pass.draw(0..(corners.len() / CORNER) as u32, 0..1);
        drop(pass);
        self.queue.submit([encoder.finish()]);
    }

    /// Brings the numbers back, of each cell one more than that of its polygon.
    fn read(&self, canvas: &Canvas, shown: &mut [u32]) -> Option<()> {
        let [columns, rows] = canvas.cells.map(|n| n as u32);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch(columns)), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            canvas.items.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &canvas.copy, layout },
            wgpu::Extent3d { width: columns, height: rows, depth_or_array_layers: 1 },
        );
        let submission = self.queue.submit([encoder.finish()]);
        canvas.copy.map_async(wgpu::MapMode::Read, .., |_| ());
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: None };
        self.device.poll(wait).ok()?;
        let view = canvas.copy.get_mapped_range(..).ok()?;
        for (shown, bytes) in shown.chunks_mut(columns as usize).zip(view.chunks(pitch(columns) as usize)) {
            for (shown, number) in shown.iter_mut().zip(bytes.as_chunks().0) {
                *shown = u32::from_le_bytes(*number).wrapping_sub(1);
            }
        }
        drop(view);
        canvas.copy.unmap();
        Some(())
    }
}

/// Bytes from one row of a copy to the next.
fn pitch(columns: u32) -> u32 {
    (4 * columns).next_multiple_of(ALIGNED)
}

impl Raster for Device {
    fn fill(&self, face: &Face, scans: &Scans, shown: &mut Vec<u32>) {
        shown.clear();
        shown.resize(face.cells[0] * face.cells[1], NONE);
        if self.failure.get().is_some() || scans.list.is_empty() {
            return;
        }
        let canvas = self.canvas(face.cells);
        let corners = corners(face, scans);
        for (number, portion) in corners.chunks(3 * PORTION * CORNER).enumerate() {
            self.draw(&canvas, portion, number == 0);
        }
        match self.read(&canvas, shown) {
            Some(()) => self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(canvas),
            None => drop(self.failure.set("what it drew could not be read back".to_owned())),
        }
    }
}

/// The corners of all triangles as the shader takes them.
fn corners(face: &Face, scans: &Scans) -> Vec<u8> {
    let ([left, right, low, high], [width, height]) = (face.window, face.pitch());
    // Depths are at most one: nearness is at most that of a plane's own distance, times the length of p.
    let farthest = DVec3::new(left.abs().max(right.abs()), low.abs().max(high.abs()), 1.0).length();
    let nearest = scans.list.iter().map(|scan| scan.plane.length()).fold(0.0, f64::max);
    let unit = 1.0 / (1.001 * nearest * farthest);

    let mut bytes = Vec::new();
    for (scan, number) in scans.list.iter().zip(1u32..) {
        // By columns and rows, in which the shader knows its cell; rows from below are rows from above there.
        let nearness = scan.plane * if scan.is_back { unit * (1.0 - BACK) } else { unit };
        let constant = nearness.dot(DVec3::new(left, low, 1.0));
        let plane = [nearness.x * width, nearness.y * height, constant];
        let mut corner = |c: DVec3| {
            let x = (2.0 * c.x - (left + right) * c.z) / (right - left);
            let y = ((low + high) * c.z - 2.0 * c.y) / (high - low);
            // In the middle of all depths, so that only what lies behind the eye is cut away.
            let place = [x, y, 0.5 * c.z, c.z];
            bytes.extend(place.iter().chain(&plane).flat_map(|x| (*x as f32).to_le_bytes()));
            bytes.extend(number.to_le_bytes());
        };
        let outline = &scans.corners[scan.edges.clone()];
        for pair in outline[1..].windows(2) {
            [outline[0], pair[0], pair[1]].into_iter().for_each(&mut corner);
        }
    }
    bytes
}

impl Canvas {
    fn new(device: &wgpu::Device, cells: [usize; 2]) -> Canvas {
        let [columns, rows] = cells.map(|n| n as u32);
        let texture = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: columns, height: rows, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let buffer = |size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
        };
        use wgpu::BufferUsages as Usages;
        Canvas {
            cells,
            items: texture(ITEMS, wgpu::TextureUsages::COPY_SRC),
            depths: texture(DEPTHS, wgpu::TextureUsages::empty()),
            corners: buffer((3 * PORTION * CORNER) as u64, Usages::VERTEX | Usages::COPY_DST),
            copy: buffer(u64::from(pitch(columns)) * u64::from(rows), Usages::MAP_READ | Usages::COPY_DST),
        }
    }
}

fn pipeline(device: &wgpu::Device) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::include_wgsl!("items.wgsl"));
    let attributes = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x3, 2 => Uint32];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("project"),
            compilation_options: Default::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: CORNER as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &attributes,
            })],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTHS,
            depth_write_enabled: Some(true),
            // Of equal ones the first, as in the item buffer.
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("show"),
            compilation_options: Default::default(),
            targets: &[Some(ITEMS.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
