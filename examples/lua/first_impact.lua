-- SPDX-License-Identifier: BSD-3-Clause

-- A time of impact and a falling ball from LuaJIT, which reads the C header as it is:
--   DYOP_LIBRARY=/usr/lib/x86_64-linux-gnu/libdyop_c.so.0.2 luajit examples/lua/first_impact.lua
local ffi = require("ffi")

-- The header without what is for the preprocessor: LuaJIT has none.
local function declarations(header)
  local kept, is_cpp, goes_on = {}, false, false
  for line in io.lines(header) do
    local directive = goes_on or line:match("^%s*#")
    if line:match("^#ifdef __cplusplus") then is_cpp = true end
    if not directive and not is_cpp then kept[#kept + 1] = line:gsub("DYOP_C_API ", "") end
    if line:match("^#endif") then is_cpp = false end
    goes_on = directive and line:match("\\$") ~= nil
  end
  return table.concat(kept, "\n")
end

local here = arg[0]:match("^(.*)/examples/lua/") or "."
ffi.cdef(declarations(here .. "/include/dyop/dyop_c.h"))
local dyop = ffi.load(os.getenv("DYOP_LIBRARY") or "dyop_c")

local holder = ffi.new("dyop_context*[1]")
assert(dyop.dyop_context_create(nil, holder) == 0)
local context = ffi.gc(holder[0], dyop.dyop_context_destroy)

-- Calls a function of the context; an error is one of Lua's, with dyop's message.
local function call(name, ...)
  local status = dyop["dyop_" .. name](context, ...)
  if status == dyop.DYOP_OK then return end
  local text = ffi.new("char[1000]")
  dyop.dyop_last_error(context, text, 1000)
  error(name .. ": " .. ffi.string(text), 2)
end

-- A value of a type, made by a call whose last argument it is.
local function made(kind, name, ...)
  local value = ffi.new("dyop_" .. kind .. "[1]")
  local arguments = { ... }
  arguments[#arguments + 1] = value
  call(name, unpack(arguments))
  return value[0]
end

-- A struct with its size set, and with the defaults of the library if it has some.
local function sized(kind, has_defaults)
  local value = ffi.new("dyop_" .. kind)
  value.size = ffi.sizeof(value)
  if has_defaults then assert(dyop["dyop_" .. kind .. "_init"](value, value.size) == 0) end
  return value
end

local function state_at(position, v)
  local state = ffi.new("dyop_state")
  state.pose.position, state.pose.rotation, state.twist.v = position, { 1, 0, 0, 0 }, v
  return state
end

-- Two balls of radius 1, centres 6 apart; B approaches at speed 2.
local ball = made("shape", "sphere_create", 1)
local query = sized("toi_query")
query.a, query.b, query.interval = ball, ball, { 0, 4 }
query.motion_a = made("motion", "rest_create", state_at({ 0, 0, 0 }, { 0, 0, 0 }).pose)
query.motion_b = made("motion", "constant_twist_create", state_at({ 6, 0, 0 }, { -2, 0, 0 }), 0)
local result = sized("toi_result")
call("time_of_impact", query, nil, result)
if result.status == dyop.DYOP_TOI_IMPACT then
  local p = result.witness.point_a
  print(string.format("balls: proven apart until %.5f, where (%.3f, %.3f, %.3f) touches",
    result.t_safe, p[0], p[1], p[2]))
end

-- A ball falls on a slab, and lies there after a second.
local options = sized("world_options", true)
options.gravity, options.max_step = { 0, 0, -9.81 }, 0.01
local world = made("world", "world_create", options)
local floor, falling = sized("body_definition", true), sized("body_definition", true)
floor.kind, floor.shape = dyop.DYOP_STATIC, made("shape", "box_create", ffi.new("double[3]", 5, 5, 1))
floor.initial = state_at({ 0, 0, -1 }, { 0, 0, 0 })
falling.shape, falling.density, falling.restitution = ball, 1000, 0
falling.initial = state_at({ 0, 0, 3 }, { 0, 0, 0 })
made("body", "world_add_body", world, floor)
local body = ffi.new("dyop_body[1]", { made("body", "world_add_body", world, falling) })
local report = sized("advance_report")
call("world_advance", world, 1, report)
local after = ffi.new("dyop_state[1]")
call("world_states", world, body, 1, after)
print(string.format("after %g s the ball is at a height of %.3f", report.t, after[0].pose.position[2]))

-- What is wrong is said.
print(select(2, pcall(call, "sphere_create", -1, ffi.new("dyop_shape[1]"))))
-- Prints:
-- balls: proven apart until 2.00000, where (1.000, 0.000, 0.000) touches
-- after 1 s the ball is at a height of 1.000
-- sphere_create: radius must be > 0 and at most 1e+60, not -1
