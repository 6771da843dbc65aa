//! Typical mistakes: each gives one error that names file, line, key and value, and says what is allowed.

const BASE: &str = r#"description = "A rod."

[run]
dt_s = 0.02

[[rods]]
name = "a"
radius_m = 0.05
clamp = ["start-segment"]

[rods.shape.straight]
length_m = 4
segments = 30
"#;

/// The error of the base scene with `from` replaced by `to`.
fn error(from: &str, to: &str) -> String {
    assert!(BASE.contains(from));
    scene::parse(&BASE.replacen(from, to, 1), "scenes/x.toml").unwrap_err().to_string()
}

macro_rules! mistakes {
    ($($name:ident: $from:expr => $to:expr, $error:expr;)*) => {
        $(#[test] fn $name() { assert_eq!(error($from, $to), concat!("scenes/x.toml:", $error)); })*
    };
}

const END: &str = "segments = 30\n";

mistakes! {
    unknown_key: "dt_s" => "dt",
        "4: run.dt is not a known key (did you mean `dt_s`?); expected one of `dt_s`, `steps`, `every`, `from`, `begin`, `integrator`";
    unit_left_out: "length_m = 4" => "length = 4",
        "12: rods[0].shape.straight.length is not a known key (did you mean `length_m`?); expected one of `start_m`, `direction`, `angle_deg`, `length_m`, `segments`";
    unknown_table: "[run]" => "[runs]",
        "3: runs is not a known key (did you mean `run`?); expected one of `description`, `gravity_m_s2`, `gravity_over_time`, `run`, `damping`, `bending`, `contact`, `obstacles`, `air`, `bodies`, `rods`, `nets`, `joins`, `eyelets`, `pulleys`, `sheaths`, `probes`, `copies`";
    unknown_shape: "shape.straight" => "shape.strait",
        "11: rods[0].shape.strait is not a known key (did you mean `straight`?); expected one of `straight`, `helix`, `arc`, `ring`, `polyline`, `knot`, `hung`, `curve`, `usd`";
    two_shapes: END => "segments = 30\n[rods.shape.ring]\nradius_m = 1\nsegments = 5\n",
        "11: rods[0].shape: it must hold exactly one key";
    missing_key: "segments = 30" => "",
        "11: rods[0].shape.straight: missing key `segments`";
    missing_shape: END => "segments = 30\n\n[[rods]]\nname = \"b\"\n",
        "15: rods[1]: missing key `shape`";
    no_rods: BASE => "", "1: there must be at least one rod (`rods`), net (`nets`) or rigid body (`bodies`)";
    empty_rods: BASE => "rods = []", "1: there must be at least one rod (`rods`), net (`nets`) or rigid body (`bodies`)";
    one_table_for_a_list: "[[rods]]" => "[rods]",
        "6: rods is a table, but it must be a list: [...], or one [[...]] for each table in it";
    syntax: "dt_s = 0.02" => "dt_s = 0.02 s", "4: not valid TOML: string values must be quoted, expected literal string";
    duplicate_key: "dt_s = 0.02" => "dt_s = 0.02\ndt_s = 0.01", "5: not valid TOML: duplicate key";
    number_with_unit: "dt_s = 0.02" => "dt_s = \"20 ms\"",
        "4: run.dt_s = \"20 ms\", but it must be a number";
    overlap_is_yes_or_no: "[run]" => "contact.allow_overlap = \"yes\"\n[run]",
        "3: contact.allow_overlap = \"yes\", but it must be true or false";
    overlap_of_an_obstacle: END => "segments = 30\n[[obstacles]]\nshape.plane = {}\nallow_overlap = true\n",
        "16: obstacles[0].allow_overlap is not a known key; expected one of `name`, `shape`, `friction`, `restitution`, `motion`";
    beginning: "dt_s = 0.02" => "begin = \"still\"",
        "4: run.begin = \"still\", but it must be `drawn` or `equilibrium`";
    two_beginnings: "dt_s = 0.02" => "begin = \"equilibrium\"\nfrom = \"runs/a\"",
        "4: run.begin: does not go with `from`; leave one of them out";
    turns_of_some: "radius_m = 0.05" => "first_turns_deg = [0, 1]",
        "8: rods[0].first_turns_deg: 2 numbers, but there must be one a segment (30)";
    turn_too_far: END => "segments = 2\n[[rods]]\nfirst_turns_deg = [0, 180]\nshape.straight = { length_m = 1, segments = 2 }\n",
        "15: rods[1].first_turns_deg[1] = 180, but it must be less than half a turn from the segment's before, 0 [degrees]";
    turn_of_what_is_held: "segments = 30" => "segments = 1\n[[rods]]\nfixed_segments = [0]\nfirst_turns_deg = [5, 0]\nshape.straight = { length_m = 1, segments = 2 }",
        "16: rods[1].first_turns_deg[0] = 5, but it must be 0 [degrees]: this segment is held";
    turns_of_a_ring: "segments = 30" => "segments = 1\n[[rods]]\nfirst_turns_deg = [5, 0, 0]\nshape.ring = { radius_m = 1, segments = 3 }",
        "15: rods[1].first_turns_deg: a closed rod has no first turns";
    branch_stiffness_of_no_branch: "radius_m = 0.05" => "branch_stiffness_n_m_rad = [1, 1]",
        "8: rods[0].branch_stiffness_n_m_rad: goes with `branch_of` a rod";
    branch_stiffness_zero: END => "segments = 2\n[[rods]]\nbranch_of = { rod = \"a\" }\nbranch_stiffness_n_m_rad = [1, 0]\nshape.straight = { length_m = 1, segments = 2 }\n",
        "16: rods[1].branch_stiffness_n_m_rad[1] = 0, but it must be finite and > 0 [N m/rad]";
    branch_rest_of_a_ball: END => "segments = 2\n[[rods]]\nbranch_of = { rod = \"a\" }\nbranch_rest_deg = [0, 1, 0]\nbranch_joint = \"ball\"\nshape.straight = { length_m = 1, segments = 2 }\n",
        "16: rods[1].branch_rest_deg: goes with a rigid `branch_joint`";
    branch_rest_too_far: END => "segments = 2\n[[rods]]\nbranch_of = { rod = \"a\" }\nbranch_rest_deg = [0, 180, 0]\nshape.straight = { length_m = 1, segments = 2 }\n",
        "16: rods[1].branch_rest_deg = [0, 180, 0], but it must be shorter than 180 [degrees]";
    time_step_zero: "dt_s = 0.02" => "dt_s = 0",
        "4: run.dt_s = 0, but it must be finite and > 0 [s]";
    no_steps: "dt_s = 0.02" => "steps = 0",
        "4: run.steps = 0, but it must be a whole number from 1 to 1000000000";
    negative_radius: "0.05" => "-0.1",
        "8: rods[0].radius_m = -0.1, but it must be finite and > 0 [m]";
    radius_of_three: "0.05" => "[1, 2, 3]",
        "8: rods[0].radius_m = [1, 2, 3], but it must be a number or [start, end]";
    radius_not_a_number: "0.05" => "[0.1, nan]",
        "8: rods[0].radius_m = [0.1, nan], but it must be finite and > 0 [m]";
    infinite_length: "length_m = 4" => "length_m = inf",
        "12: rods[0].shape.straight.length_m = inf, but it must be finite and > 0 [m]";
    no_segments: "segments = 30" => "segments = 0",
        "13: rods[0].shape.straight.segments = 0, but it must be a whole number from 1 to 10000000";
    half_a_segment: "segments = 30" => "segments = 1.5",
        "13: rods[0].shape.straight.segments = 1.5, but it must be a whole number";
    too_many_segments: "segments = 30" => "segments = 4000000000000",
        "13: rods[0].shape.straight.segments = 4000000000000, but it must be a whole number from 1 to 10000000";
    too_many_in_all: END => "segments = 30\n\n[[rods]]\nshape.ring = { radius_m = 1, segments = 10_000_000 }\n",
        "15: rods[1]: with this rod the scene has 10000030 segments, but 10000000 are the most";
    too_many_branches: "clamp" => "tree = { branches = 10_000_000, levels = 2, segments = 10_000_000 }\nclamp",
        "6: rods[0]: with this rod the scene has 100000000000030 segments, but 10000000 are the most";
    tree_cut_in_no_way: "clamp" => "tree = { branches = 3, levels = 1 }\nclamp",
        "9: rods[0].tree.branches: give `segments` or `segment_m` with it";
    tree_cut_in_two_ways: "clamp" => "tree = { branches = 3, levels = 1, segments = 2, segment_m = 1 }\nclamp",
        "9: rods[0].tree.segment_m: give either `segments` or `segment_m`, not both";
    tree_cut_too_fine: "clamp" => "tree = { branches = 3, levels = 1, segment_m = 1e-9 }\nclamp",
        "6: rods[0]: with this tree the scene has more than 10000000 segments";
    air_of_no_density: "[run]" => "air = { density_kg_m3 = 0 }\n[run]",
        "3: air.density_kg_m3 = 0, but it must be finite and > 0 [kg/m^3]";
    negative_drag: "[run]" => "air.normal_drag = -1\n[run]",
        "3: air.normal_drag = -1, but it must be finite and >= 0";
    wind_without_a_velocity: "[run]" => "air.wind = {}\n[run]", "3: air.wind: missing key `velocity_m_s`";
    wind_not_a_number: "[run]" => "air.wind.velocity_m_s = [0, nan, 0]\n[run]",
        "3: air.wind.velocity_m_s = [0, nan, 0], but it must be three finite numbers [m/s]";
    negative_gusts: "[run]" => "air.wind = { velocity_m_s = [1, 0, 0], gusts.strength = -0.1 }\n[run]",
        "3: air.wind.gusts.strength = -0.1, but it must be finite and >= 0";
    gusts_of_no_length: "[run]" => "air.wind = { velocity_m_s = [1, 0, 0], gusts = { strength = 1, length_m = 0 } }\n[run]",
        "3: air.wind.gusts.length_m = 0, but it must be finite and > 0 [m]";
    rotation_in_no_time: "[run]" => "air.wind = { velocity_m_s = [1, 0, 0], rotation_period_s = 0 }\n[run]",
        "3: air.wind.rotation_period_s = 0, but it must be finite and > 0 [s]";
    fewer_branches_than_levels: "clamp" => "tree = { branches = 3, levels = 5, segments = 1 }\nclamp",
        "9: rods[0].tree.branches = 3, but it must be a whole number from 5 to 10000000";
    no_direction: END => "segments = 30\ndirection = [0, 0, 0]\n",
        "14: rods[0].shape.straight.direction = [0, 0, 0], but it must be a vector other than zero";
    direction_in_the_plane: END => "segments = 30\ndirection = [0, 1]\n",
        "14: rods[0].shape.straight.direction = [0, 1], but it must be three numbers: [x, y, z]";
    direction_in_four_dimensions: END => "segments = 30\ndirection = [0, 1, 0, 0]\n",
        "14: rods[0].shape.straight.direction = [0, 1, 0, 0], but it must be three numbers: [x, y, z]";
    direction_and_angle: END => "segments = 30\ndirection = [1, 0, 0]\nangle_deg = 3\n",
        "15: rods[0].shape.straight.angle_deg: give either `direction` or `angle_deg`, not both";
    unknown_clamp: "start-segment" => "start",
        "9: rods[0].clamp[0] = \"start\", but it must be one of `start-segment`, `end-segment`, `start-face`, `end-face`";
    clamp_twice: "\"start-segment\"" => "\"start-face\", \"start-face\"", "9: rods[0].clamp[1]: named twice";
    segment_out_of_range: "clamp" => "fixed_segments = [0, 30]\nclamp",
        "9: rods[0].fixed_segments[1] = 30, but it must be a segment's index: 0 to 29, or -30 to -1 from the end";
    segment_fixed_twice: "clamp" => "fixed_segments = [3, 0, -27]\nclamp",
        "9: rods[0].fixed_segments[2]: entries 0 (3) and 2 (-27) are both segment 3";
    huge_density: "clamp" => "density_kg_m3 = 1e300\nclamp",
        "9: rods[0].density_kg_m3 = 1e300, but it must be 1e30 in size at most [kg/m^3]";
    huge_radius: "0.05" => "[1e13, 1]",
        "8: rods[0].radius_m = [1e13, 1], but it must be 1e12 m at most";
    huge_section: "radius_m = 0.05" => "section.circle.radius_m = 1e20",
        "8: rods[0].section.circle.radius_m = 1e20, but it must be 1e-12 to 1e12 m";
    huge_gravity: "[run]" => "gravity_m_s2 = [0, 0, -1e300]\n[run]",
        "3: gravity_m_s2 = [0, 0, -1e300], but it must be three numbers, each 1e30 in size at most [m/s^2]";
    huge_friction: END => "segments = 30\n[contact]\nfriction = 1e300\n",
        "15: contact.friction = 1e300, but it must be 1e30 in size at most";
    huge_obstacle: END => "segments = 30\n[[obstacles]]\nshape.sphere = { radius_m = 1e300 }\n",
        "15: obstacles[0].shape.sphere.radius_m = 1e300, but it must be 1e30 in size at most [m]";
    unknown_rod: END => "segments = 30\n\n[[rods]]\nbranch_of = { rod = \"trunk\" }\nshape.straight = { length_m = 1, segments = 2 }\n",
        "16: rods[1].branch_of.rod = \"trunk\", but it must be the name of a rod that comes before it: `a`";
    branch_with_a_start: END => "segments = 30\n\n[[rods]]\nbranch_of = { rod = \"a\" }\nshape.straight = { start_m = [0, 0, 0], length_m = 1, segments = 2 }\n",
        "17: rods[1].shape.straight.start_m: a branch starts on its parent; leave it out";
    fraction_beyond_the_end: END => "segments = 30\n\n[[rods]]\nbranch_of = { rod = \"a\", fraction = 1.5 }\nshape.straight = { length_m = 1, segments = 2 }\n",
        "16: rods[1].branch_of.fraction = 1.5, but it must be 0 (the segment's start) to 1 (its end)";
    name_twice: END => "segments = 30\n\n[[rods]]\nname = \"a\"\nshape.ring = { radius_m = 1, segments = 5 }\n",
        "16: rods[1].name = \"a\", but it must be a name that no other rod has";
    coinciding_nodes: END => "segments = 30\n\n[[rods]]\nshape.polyline.nodes_m = [[0, 0, 0], [1, 0, 0], [1, 0, 0]]\n",
        "16: rods[1].shape.polyline.nodes_m[2]: nodes 1 and 2 are 0 m apart, but neighbours must be 1e-12 to 1e12 m apart";
    node_not_a_number: END => "segments = 30\n\n[[rods]]\nshape.polyline.nodes_m = [[0, 0, 0],\n[1, 0, nan]]\n",
        "17: rods[1].shape.polyline.nodes_m[1] = [1, 0, nan], but it must be three finite numbers [m]";
    one_node: END => "segments = 30\n\n[[rods]]\nshape.polyline.nodes_m = [[0, 0, 0]]\n",
        "16: rods[1].shape.polyline.nodes_m: 1 nodes, but there must be at least 2";
    arc_without_a_side: "[rods.shape.straight]\nlength_m = 4" => "[rods.shape.arc]\nradius_m = 1\nangle_deg = 90\ntowards = [2, 0, 0]",
        "14: rods[0].shape.arc.towards: `towards` must not be parallel to `direction`";
    empty_load: END => "segments = 30\n\n[[rods.loads]]\nat = \"end-face\"\n",
        "15: rods[0].loads[0]: give `force_n` or `torque_n_m` or both, or `times_s` and lists";
    load_without_a_place: END => "segments = 30\n\n[[rods.loads]]\nforce_n = [0, 0, 1]\n",
        "15: rods[0].loads[0]: give either `at` or `segment`";
    rest_of_a_wrong_type: "clamp" => "rest = 3\nclamp",
        "9: rods[0].rest = 3, but it must be a string or a table";
    unknown_rest: "clamp" => "rest = \"bent\"\nclamp",
        "9: rods[0].rest = \"bent\", but it must be one of `initial`, `straight`, `darboux_per_m`, `darboux_of_joints_per_m`";
    rest_that_no_joint_reaches: "clamp" => "rest = { darboux_per_m = [0, 20, 0] }\nclamp",
        "9: rods[0].rest.darboux_per_m = [0, 20, 0], but it must be shorter than 2 / segment length = 15 [1/m]";
    negative_compliance: "clamp" => "stretch = { compliance_m_per_n = -1 }\nclamp",
        "9: rods[0].stretch.compliance_m_per_n = -1, but it must be finite and >= 0 [m/N]";
    too_much_twist: "clamp" => "twist_deg = 9999\nclamp",
        "9: rods[0].twist_deg = 9999, but it must be less than half a turn a joint: 5220 [degrees]";
    joined_to_itself: END => "segments = 30\n\n[[joins]]\na = { rod = \"a\" }\nb = { rod = \"a\" }\n",
        "15: joins[0]: `a` and `b` are the same segment";
    joined_from_afar: END => "segments = 30\n\n[[joins]]\na = { rod = \"a\" }\nb = { rod = \"a\", segment = 0, fraction = 0 }\n",
        "15: joins[0]: `a` and `b` are 4 m apart, but places to be joined must meet within 0.00133333 m";
    clamped_ring: "[rods.shape.straight]\nlength_m = 4" => "[rods.shape.ring]\nradius_m = 4",
        "9: rods[0].clamp[0]: a closed rod has no ends; name `fixed_segments` instead";
    mass_that_is_too_small_to_compute_with: "0.05" => "1e-200",
        "6: rods[0]: this gives a model that cannot be simulated: segment 0: axial inertia = 0, but it must be finite and > 0";
    negative_friction: END => "segments = 30\n[contact]\nfriction = -0.1\n",
        "15: contact.friction = -0.1, but it must be finite and >= 0";
    friction_of_a_wrong_type: END => "segments = 30\n[contact]\nfriction = \"much\"\n",
        "15: contact.friction = \"much\", but it must be a number or { at_rest = ..., sliding = ... }";
    half_of_the_friction: END => "segments = 30\n[contact]\nfriction = { at_rest = 1 }\n",
        "15: contact.friction: missing key `sliding`";
    infinite_friction: END => "segments = 30\n[contact]\nfriction = { at_rest = inf, sliding = 1 }\n",
        "15: contact.friction.at_rest = inf, but it must be finite and >= 0";
    more_friction_sliding: END => "segments = 30\n[contact]\nfriction = { at_rest = 0.2, sliding = 0.3 }\n",
        "15: contact.friction.sliding = 0.3, but it must be 0 to at_rest = 0.2";
    too_much_restitution: END => "segments = 30\n[contact]\nrestitution = 1.5\n",
        "15: contact.restitution = 1.5, but it must be 0 to 1";
    unknown_obstacle: END => "segments = 30\n[[obstacles]]\nshape.cube = { radius_m = 1 }\n",
        "15: obstacles[0].shape.cube is not a known key; expected one of `plane`, `sphere`, `capsule`, `box`, `cylinder`, `mesh`";
    obstacle_without_a_shape: END => "segments = 30\n[[obstacles]]\nname = \"b\"\n",
        "14: obstacles[0]: missing key `shape`";
    obstacle_name_twice: END => "segments = 30\n[[obstacles]]\nname = \"b\"\nshape.plane = {}\n[[obstacles]]\nname = \"b\"\nshape.plane = {}\n",
        "18: obstacles[1].name = \"b\", but it must be a name that no other obstacle has";
    plane_without_a_normal: END => "segments = 30\n[[obstacles]]\nshape.plane.normal = [0, 0, 0]\n",
        "15: obstacles[0].shape.plane.normal = [0, 0, 0], but it must be a vector other than zero";
    sphere_without_a_size: END => "segments = 30\n[[obstacles]]\nshape.sphere = { radius_m = 0 }\n",
        "15: obstacles[0].shape.sphere.radius_m = 0, but it must be finite and > 0 [m]";
    capsule_without_a_length: END => "segments = 30\n[[obstacles]]\nshape.capsule = { start_m = [1, 0, 0], end_m = [1, 0, 0], radius_m = 1 }\n",
        "15: obstacles[0].shape.capsule.end_m = [1, 0, 0], but it must be 1e-12 to 1e12 m from start_m";
    flat_box: END => "segments = 30\n[[obstacles]]\nshape.box.sides_m = [1, 0, 1]\n",
        "15: obstacles[0].shape.box.sides_m[1] = 0, but it must be finite and > 0 [m]";
    box_that_is_turned_twice: END => "segments = 30\n[[obstacles]]\n[obstacles.shape.box]\nsides_m = [1, 1, 1]\nturn_deg = [0, 0, 1]\norientation = [1, 0, 0, 0]\n",
        "17: obstacles[0].shape.box.turn_deg: give either `orientation` or `turn_deg`, not both";
    cylinder_without_a_length: END => "segments = 30\n[[obstacles]]\nshape.cylinder = { start_m = [1, 0, 0], end_m = [1, 0, 0], radius_m = 1 }\n",
        "15: obstacles[0].shape.cylinder.end_m = [1, 0, 0], but it must be 1e-12 to 1e12 m from start_m";
    mesh_without_a_file: END => "segments = 30\n[[obstacles]]\nshape.mesh.scale = 2\n",
        "15: obstacles[0].shape.mesh: missing key `file`";
    mesh_of_no_file: END => "segments = 30\n[[obstacles]]\nshape.mesh.file = \"rock.obj\"\n",
        "15: obstacles[0].shape.mesh.file = \"rock.obj\", but it must be a file of triangles (.obj or .stl), and there is none at scenes/rock.obj";
    knot_in_a_short_rope: "[rods.shape.straight]" => "[rods.shape.knot]\nloop_m = 1",
        "12: rods[0].shape.knot.loop_m = 1, but it must be at most length_m / 8.8 = 0.454545 [m]";
    coarse_knot: "[rods.shape.straight]" => "[rods.shape.knot]\nloop_m = 0.4",
        "14: rods[0].shape.knot.segments = 30, but it must be at least 8 length_m / loop_m = 80";
    no_strands: "clamp" => "strands = { count = 0, on = { radius_m = 1 } }\nclamp",
        "9: rods[0].strands.count = 0, but it must be a whole number from 1 to 10000000";
    too_many_strands: "clamp" => "strands = { count = 1_000_000, on = { radius_m = 1 } }\nclamp",
        "6: rods[0]: with this rod the scene has 30000000 segments, but 10000000 are the most";
    strands_with_a_direction: END => "segments = 30\nangle_deg = 5\n[rods.strands]\ncount = 3\non = { radius_m = 1 }\n",
        "14: rods[0].shape.straight.angle_deg: strands start on their sphere and point outwards; leave it out";
    bent_strands: END => "segments = 30\n[[rods]]\nshape.helix = { radius_m = 1, height_m = 1, winding = 1, segments = 9 }\nstrands = { count = 2, on = { radius_m = 1 } }\n",
        "15: rods[1].shape: strands are straight; give `shape.straight`";
    strands_on_a_rod: END => "segments = 30\n[[rods]]\nshape.straight = { length_m = 1, segments = 9 }\nbranch_of = { rod = \"a\" }\nstrands = { count = 2, on = { radius_m = 1 } }\n",
        "16: rods[1].branch_of.rod: strands start on their sphere; leave `branch_of` out";
    a_heap_of_helices: END => "segments = 30\n[[rods]]\nshape.helix = { radius_m = 1, height_m = 1, winding = 1, segments = 9 }\nheap = { count = 2, spacing_m = 1 }\n",
        "15: rods[1].shape: rods of a heap are straight; give `shape.straight`";
    a_heap_without_height: "clamp" => "heap = { count = 2, spacing_m = 0 }\nclamp",
        "9: rods[0].heap.spacing_m = 0, but it must be finite and > 0 [m]";
    too_large_a_heap: "clamp" => "heap = { count = 1_000_000, spacing_m = 1 }\nclamp",
        "6: rods[0]: with this rod the scene has 30000000 segments, but 10000000 are the most";
    a_heap_of_strands: "clamp" => "strands = { count = 2, on = { radius_m = 1 } }\nheap = { count = 2, spacing_m = 1 }\nclamp",
        "9: rods[0].strands.count: give either `strands` or `heap`";
    a_heap_with_a_direction: END => "segments = 30\ndirection = [0, 0, 1]\n[rods.heap]\ncount = 3\nspacing_m = 1\n",
        "14: rods[0].shape.straight.direction: rods of a heap lie about its `centre_m`; leave it out";
    much_jitter: "clamp" => "strands = { count = 2, on = { radius_m = 1 }, jitter = 2 }\nclamp",
        "9: rods[0].strands.jitter = 2, but it must be 0 to 1";
    net_in_space: END => "segments = 30\n[[nets]]\nsize_m = [1, 1, 1]\nmeshes = [1, 1]\nsegments = 1\n",
        "15: nets[0].size_m = [1, 1, 1], but it must be two values: [x, y]";
    net_without_a_mesh: END => "segments = 30\n[[nets]]\nsize_m = [1, 1]\nmeshes = [0, 1]\nsegments = 1\n",
        "16: nets[0].meshes[0] = 0, but it must be a whole number from 1 to 10000000";
    woven_of_segments_that_are_too_long: END => "segments = 30\n[[nets]]\nsize_m = [1, 1]\nmeshes = [3, 3]\nsegments = 1\nwoven = true\n",
        "17: nets[0].segments = 1, but it must be a whole number from 2 to 10000000";
    too_fine_a_net: END => "segments = 30\n[[nets]]\nsize_m = [1, 1]\nmeshes = [10_000, 10_000]\nsegments = 1\n",
        "14: nets[0]: with this net the scene has 200020030 segments, but 10000000 are the most";
    net_of_nothing: END => "segments = 30\n[[nets]]\nsize_m = [1, 1e-15]\nmeshes = [1, 1]\nsegments = 1\n",
        "15: nets[0].size_m[1]: segments of 0.000000000000001 m, but they must be 1e-12 to 1e12 m long";
    unknown_section: "clamp" => "section.square = { width_m = 1 }\nclamp",
        "9: rods[0].section.square is not a known key; expected one of `circle`, `tube`, `rectangle`, `ellipse`, `stiffness`";
    section_of_a_wrong_type: "clamp" => "section = 3\nclamp",
        "9: rods[0].section = 3, but it must be a string or a table";
    rectangle_of_no_height: "clamp" => "section.rectangle = { width_m = 1, height_m = 0 }\nclamp",
        "9: rods[0].section.rectangle.height_m = 0, but it must be finite and > 0 [m]";
    tube_without_a_wall: "clamp" => "section.tube = { outer_radius_m = 0.1, inner_radius_m = 0.1 }\nclamp",
        "9: rods[0].section.tube.inner_radius_m = 0.1, but it must be less than `outer_radius_m`";
    stiffness_of_no_size: "radius_m = 0.05" => "section.stiffness = { bending_n_m2 = [1, 2], torsion_n_m2 = 1, mass_kg_m = 1 }",
        "8: rods[0].section: give the rod's `radius_m` with it, for contacts and air";
    stiffness_about_one_axis: "clamp" => "section.stiffness = { bending_n_m2 = [1], torsion_n_m2 = 1, mass_kg_m = 1 }\nclamp",
        "9: rods[0].section.stiffness.bending_n_m2 = [1], but it must be two values: [x, y]";
    stiffness_that_no_stretch_asks_for: "clamp" => "section.stiffness = { bending_n_m2 = [1, 2], torsion_n_m2 = 1, mass_kg_m = 1, stretch_n = 5 }\nclamp",
        "9: rods[0].section.stiffness.stretch_n: goes with `stretch = \"physical\"`";
    stretch_that_no_stiffness_says: "clamp" => "stretch = \"physical\"\nsection.stiffness = { bending_n_m2 = [1, 2], torsion_n_m2 = 1, mass_kg_m = 1, shear_n = 5 }\nclamp",
        "10: rods[0].section: missing key `stretch_n`, which `stretch = \"physical\"` needs";
    stiffness_and_a_material: "clamp" => "density_kg_m3 = 5\nsection.stiffness = { bending_n_m2 = [1, 2], torsion_n_m2 = 1, mass_kg_m = 1 }\nclamp",
        "9: rods[0].density_kg_m3: `section.stiffness` says what the rod resists and weighs; leave it out";
    section_and_pieces: "clamp" => "section.circle.radius_m = 1\npieces = []\nclamp",
        "9: rods[0].section: give either `section` or `pieces`, not both";
    no_pieces: "clamp" => "pieces = []\nclamp", "9: rods[0].pieces: there must be at least one piece";
    pieces_backwards: "clamp" => "pieces = [{ until = 0.5, section.circle.radius_m = 1 }, { until = 0.4, section.circle.radius_m = 2 }, { section.circle.radius_m = 1 }]\nclamp",
        "9: rods[0].pieces[1].until = 0.4, but it must be more than that of the piece before";
    piece_beyond_the_end: "clamp" => "pieces = [{ until = 1, section.circle.radius_m = 1 }, { section.circle.radius_m = 1 }]\nclamp",
        "9: rods[0].pieces[0].until = 1, but it must be > 0 and < 1, a fraction of the rod's length";
    piece_that_ends_before_the_rod: "clamp" => "pieces = [{ until = 0.5, section.circle.radius_m = 1 }]\nclamp",
        "9: rods[0].pieces[0].until: the last piece goes on to the rod's end; leave it out";
    section_of_a_tree: "clamp" => "section.rectangle = { width_m = 1, height_m = 1 }\ntree = { branches = 3, levels = 1, segments = 2 }\nclamp",
        "9: rods[0].section: a tree's trunk and branches are full circles; leave it out";
    frame_along_the_rod: "clamp" => "frame.d1 = [-2, 0, 0]\nclamp",
        "9: rods[0].frame.d1 = [-2, 0, 0], but it must be a direction across the rod's first segment";
    negative_relaxation: "clamp" => "inner_damping.twist_s = -1\nclamp",
        "9: rods[0].inner_damping.twist_s = -1, but it must be finite and >= 0 [s]";
    unknown_measure: "[run]" => "bending = \"rest\"\n[run]",
        "3: bending = \"rest\", but it must be one of `angle`, `paper`, `rest-rotation`";
    rest_of_too_few_joints: "clamp" => "rest = { darboux_of_joints_per_m = [[0, 0, 1]] }\nclamp",
        "9: rods[0].rest.darboux_of_joints_per_m: 1 vectors, but there must be one a joint (29)";
    negative_seed: "clamp" => "tree = { branches = 3, levels = 1, segments = 2, seed = -1 }\nclamp",
        "9: rods[0].tree.seed = -1, but it must be a whole number >= 0";
    description_that_is_no_text: "\"A rod.\"" => "3", "1: description = 3, but it must be a string";
    net_called_as_a_rod: END => "segments = 30\n[[nets]]\nname = \"a\"\nsize_m = [1, 1]\nmeshes = [1, 1]\nsegments = 1\n",
        "15: nets[0].name = \"a\", but it must be a name that no other rod has";
}

#[test]
fn a_name_with_a_line_break_does_not_break_the_error() {
    let text = BASE.replace("name = \"a\"", "name = \"a\\nb\"");
    let branch = "\n[[rods]]\nbranch_of = { rod = \"trunk\" }\nshape.straight = { length_m = 1, segments = 3 }\n";
    let error = scene::parse(&(text + branch), "scenes/x.toml").unwrap_err().to_string();
    assert!(error.contains("a b") && !error.contains('\n'), "{error}");
}
