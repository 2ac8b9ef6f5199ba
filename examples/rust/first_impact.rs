// SPDX-License-Identifier: BSD-3-Clause

// A time of impact from Rust, without a crate:
//   rustc -O examples/rust/first_impact.rs -L FOLDER_OF_LIBDYOP_C
use std::ffi::CStr;
use std::os::raw::{c_char, c_double, c_int, c_void};
use std::ptr::null;

// From dyop/dyop_c.h.
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Handle {
    index: u32,
    generation: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Pose {
    position: [f64; 3],
    rotation: [f64; 4], // w, x, y, z
}

#[repr(C)]
struct State {
    pose: Pose,
    v: [f64; 3],
    w: [f64; 3],
}

#[repr(C)]
struct ToiQuery {
    size: u32,
    reserved: u32,
    a: Handle,
    b: Handle,
    motion_a: Handle,
    motion_b: Handle,
    interval: [f64; 2],
}

#[repr(C)]
#[derive(Default)]
struct Witness {
    lower: f64,
    upper: f64,
    point_a: [f64; 3],
    point_b: [f64; 3],
    normal: [f64; 3],
    triangles: [i32; 2],
    children: [i32; 2],
}

#[repr(C)]
#[derive(Default)]
struct ToiResult {
    size: u32,
    status: i32,
    t_safe: f64,
    t_hit: f64,
    rounding_allowance: f64,
    closing_speed: f64,
    pose_a: Pose,
    pose_b: Pose,
    has_contact: i32,
    reserved: i32,
    witness: Witness,
    node_pairs: i64,
}
const TOI_IMPACT: i32 = 2;

#[link(name = "dyop_c")]
extern "C" {
    fn dyop_context_create(options: *const c_void, context: *mut *mut c_void) -> c_int;
    fn dyop_context_destroy(context: *mut c_void);
    fn dyop_last_error(context: *const c_void, text: *mut c_char, capacity: usize) -> c_int;
    fn dyop_sphere_create(context: *mut c_void, radius: c_double, shape: *mut Handle) -> c_int;
    fn dyop_rest_create(context: *mut c_void, pose: *const Pose, motion: *mut Handle) -> c_int;
    fn dyop_constant_twist_create(
        context: *mut c_void,
        state: *const State,
        time: c_double,
        motion: *mut Handle,
    ) -> c_int;
    fn dyop_time_of_impact(
        context: *mut c_void,
        query: *const ToiQuery,
        options: *const c_void,
        result: *mut ToiResult,
    ) -> c_int;
}

/// Owns shapes and motions; they live as long as it does.
struct Context(*mut c_void);

impl Context {
    fn new() -> Result<Context, String> {
        let mut context = std::ptr::null_mut();
        match unsafe { dyop_context_create(null(), &mut context) } {
            0 => Ok(Context(context)),
            status => Err(format!("no context: status {status}")),
        }
    }

    fn check(&self, status: c_int) -> Result<(), String> {
        if status == 0 {
            return Ok(());
        }
        let mut text = [0 as c_char; 1000];
        unsafe { dyop_last_error(self.0, text.as_mut_ptr(), text.len()) };
        Err(unsafe { CStr::from_ptr(text.as_ptr()) }.to_string_lossy().into_owned())
    }

    fn sphere(&self, radius: f64) -> Result<Handle, String> {
        let mut shape = Handle::default();
        self.check(unsafe { dyop_sphere_create(self.0, radius, &mut shape) })?;
        Ok(shape)
    }

    fn at_rest(&self, position: [f64; 3]) -> Result<Handle, String> {
        let pose = Pose { position, rotation: [1.0, 0.0, 0.0, 0.0] };
        let mut motion = Handle::default();
        self.check(unsafe { dyop_rest_create(self.0, &pose, &mut motion) })?;
        Ok(motion)
    }

    fn moving(&self, position: [f64; 3], v: [f64; 3]) -> Result<Handle, String> {
        let pose = Pose { position, rotation: [1.0, 0.0, 0.0, 0.0] };
        let state = State { pose, v, w: [0.0; 3] };
        let mut motion = Handle::default();
        self.check(unsafe { dyop_constant_twist_create(self.0, &state, 0.0, &mut motion) })?;
        Ok(motion)
    }

    fn time_of_impact(&self, query: &ToiQuery) -> Result<ToiResult, String> {
        let size = std::mem::size_of::<ToiResult>() as u32;
        let mut result = ToiResult { size, ..Default::default() };
        self.check(unsafe { dyop_time_of_impact(self.0, query, null(), &mut result) })?;
        Ok(result)
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        unsafe { dyop_context_destroy(self.0) };
    }
}

fn main() -> Result<(), String> {
    let dyop = Context::new()?;
    // Two balls of radius 1, centres 6 apart; B approaches at speed 2.
    let ball = dyop.sphere(1.0)?;
    let query = ToiQuery {
        size: std::mem::size_of::<ToiQuery>() as u32,
        reserved: 0,
        a: ball,
        b: ball,
        motion_a: dyop.at_rest([0.0, 0.0, 0.0])?,
        motion_b: dyop.moving([6.0, 0.0, 0.0], [-2.0, 0.0, 0.0])?,
        interval: [0.0, 4.0],
    };
    let result = dyop.time_of_impact(&query)?;
    if result.status == TOI_IMPACT {
        let [x, y, z] = result.witness.point_a;
        println!("balls: proven apart until {:.5}, where ({x:.3}, {y:.3}, {z:.3}) touches", result.t_safe);
    }
    // What is wrong is said.
    if let Err(message) = dyop.sphere(-1.0) {
        println!("{message}");
    }
    Ok(())
}
// Prints:
// balls: proven apart until 2.00000, where (1.000, 0.000, 0.000) touches
// radius must be > 0 and at most 1e+60, not -1
