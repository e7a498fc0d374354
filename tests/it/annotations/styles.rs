//! Figures in many styles, each with where its joints are.

use super::canvas::{Canvas, PAPER};

/// A drawing and where its joints are, by name.
pub(crate) struct Drawn {
    pub(crate) name: &'static str,
    pub(crate) canvas: Canvas,
    pub(crate) joints: Vec<(&'static str, [f64; 2])>,
}

/// Joints of a figure of that size at a corner: right and left are the figure's own.
#[derive(Clone, Copy)]
struct Pose {
    corner: [f64; 2],
    height: f64,
    /// From the top of the head, in heights: right shoulder, elbow, hand; hip, knee, foot. The left side is the mirror image.
    limbs: [[f64; 2]; 6],
    neck: [f64; 2],
}

const ARMS_OUT: Pose = Pose {
    corner: [0.0, 0.0],
    height: 1.0,
    limbs: [[-0.09, 0.34], [-0.22, 0.37], [-0.36, 0.36], [-0.06, 0.62], [-0.09, 0.8], [-0.11, 0.97]],
    neck: [0.0, 0.13],
};
const ARMS_DOWN: Pose =
    Pose { limbs: [[-0.1, 0.33], [-0.19, 0.46], [-0.25, 0.58], [-0.06, 0.62], [-0.08, 0.8], [-0.1, 0.97]], ..ARMS_OUT };
const ARMS_UP: Pose = Pose {
    limbs: [[-0.08, 0.34], [-0.24, 0.27], [-0.29, 0.1], [-0.05, 0.63], [-0.12, 0.8], [-0.17, 0.97]],
    ..ARMS_OUT
};

impl Pose {
    fn at(self, corner: [f64; 2], height: f64) -> Self {
        Self { corner, height, ..self }
    }

    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.corner[0] + x * self.height, self.corner[1] + y * self.height]
    }

    /// Right shoulder, elbow, hand, hip, knee, foot and the same of the left side.
    fn side(&self, sign: f64) -> [[f64; 2]; 6] {
        self.limbs.map(|[x, y]| self.place([-x * sign, y]))
    }

    fn joints(&self) -> Vec<(&'static str, [f64; 2])> {
        let [right, left] = [self.side(-1.0), self.side(1.0)];
        let middle =
            |one: [f64; 2], other: [f64; 2]| [f64::midpoint(one[0], other[0]), f64::midpoint(one[1], other[1])];
        let root = middle(right[3], left[3]);
        let mut joints =
            vec![("root", root), ("hip", root), ("torso", middle(right[0], left[0])), ("neck", self.place(self.neck))];
        let names = ["right_shoulder", "right_elbow", "right_hand", "right_hip", "right_knee", "right_foot"];
        joints.extend(names.into_iter().zip(right));
        let names = ["left_shoulder", "left_elbow", "left_hand", "left_hip", "left_knee", "left_foot"];
        joints.extend(names.into_iter().zip(left));
        joints
    }
}

/// A circle, a line down, and lines for limbs.
fn stick(canvas: &mut Canvas, pose: &Pose) {
    let head = pose.place(pose.neck);
    canvas.ellipse(head, [0.1 * pose.height, 0.12 * pose.height]);
    let joints = pose.joints();
    let [torso, root] = [joints[2].1, joints[0].1];
    canvas.stroke(&[[head[0], head[1] + 0.12 * pose.height], torso, root]);
    for sign in [-1.0, 1.0] {
        let [_, elbow, hand, _, knee, foot] = pose.side(sign);
        canvas.stroke(&[torso, elbow, hand]);
        canvas.stroke(&[root, knee, foot]);
    }
}

/// A body with a volume, all of one color.
fn solid(canvas: &mut Canvas, pose: &Pose, [arm, leg, trunk]: [f64; 3], color: [u8; 4]) {
    let size = |share: f64| share * pose.height;
    let joints = pose.joints();
    let [torso, root, neck] = [joints[2].1, joints[0].1, joints[3].1];
    canvas.blob(neck, [size(0.1), size(0.125)], color);
    canvas.limb(&[neck, torso], size(0.035), color);
    canvas.limb(
        &[[torso[0], torso[1] + size(trunk * 0.6)], [root[0], root[1] - size(trunk * 0.4)]],
        size(trunk),
        color,
    );
    for sign in [-1.0, 1.0] {
        let [shoulder, elbow, hand, hip, knee, foot] = pose.side(sign);
        canvas.limb(&[[shoulder[0], shoulder[1]], elbow, hand], size(arm), color);
        canvas.limb(&[hip, knee, foot], size(leg), color);
    }
}

fn face(canvas: &mut Canvas, pose: &Pose) {
    let [x, y] = pose.place(pose.neck);
    let size = pose.height;
    for side in [-0.035, 0.035] {
        canvas.ellipse([x + side * size, y - 0.02 * size], [0.008 * size; 2]);
    }
    canvas.arc([x, y + 0.02 * size], [0.04 * size, 0.03 * size], [0.05, 0.45]);
}

const BODY: [u8; 4] = [226, 120, 60, 255];

fn drawn(name: &'static str, pose: Pose, canvas: Canvas) -> Drawn {
    Drawn { name, canvas, joints: pose.joints() }
}

/// The arms of a stick figure begin on its trunk, and its legs at one place.
fn on_the_trunk(pose: Pose) -> Pose {
    let [_, elbow, hand, _, knee, foot] = pose.limbs;
    Pose { limbs: [[-0.01, pose.limbs[0][1]], elbow, hand, [-0.01, pose.limbs[3][1]], knee, foot], ..pose }
}

pub(crate) fn stick_figure() -> Drawn {
    let pose = on_the_trunk(ARMS_DOWN).at([250.0, 60.0], 480.0);
    let mut canvas = Canvas::new(500, 620, 4.0);
    stick(&mut canvas, &pose);
    face(&mut canvas, &pose);
    drawn("stick_figure", pose, canvas)
}

fn stick_on_lined_paper() -> Drawn {
    let pose = on_the_trunk(ARMS_UP).at([300.0, 80.0], 560.0);
    let mut canvas = Canvas::new(620, 760, 4.5);
    stick(&mut canvas, &pose);
    canvas.rule(38.0, 0.012);
    canvas.weather(1.0, 0.15);
    drawn("stick_on_lined_paper", pose, canvas)
}

fn outlined(name: &'static str, pose: Pose, widths: [f64; 3], size: [usize; 2], pen: f64) -> Drawn {
    let mut canvas = Canvas::new(size[0], size[1], pen);
    solid(&mut canvas, &pose, widths, BODY);
    canvas.outline(BODY);
    face(&mut canvas, &pose);
    drawn(name, pose, canvas)
}

fn with_gaps() -> Drawn {
    let pose = ARMS_OUT.at([320.0, 60.0], 620.0);
    let mut figure = outlined("gaps_in_the_outline", pose, [0.035, 0.045, 0.1], [640, 760], 3.5);
    for gap in [[-0.1, 0.5], [0.16, 0.33], [0.03, 0.8]] {
        figure.canvas.rub(pose.place(gap), 7.0);
    }
    figure
}

/// An outline in pieces, so that no gap alone lets the figure out.
fn with_many_gaps() -> Drawn {
    let pose = ARMS_OUT.at([320.0, 60.0], 620.0);
    let mut figure = outlined("outline_in_pieces", pose, [0.035, 0.045, 0.1], [640, 760], 3.5);
    for gap in [[-0.1, 0.5], [0.16, 0.33], [0.03, 0.8], [-0.25, 0.4], [0.13, 0.9], [-0.07, 0.13]] {
        figure.canvas.rub(pose.place(gap), 8.5);
    }
    figure
}

fn outlined_on_lined_paper() -> Drawn {
    let pose = ARMS_OUT.at([330.0, 70.0], 640.0);
    let mut figure = outlined("outlined_on_lined_paper", pose, [0.035, 0.045, 0.1], [680, 800], 3.5);
    figure.canvas.rule(42.0, -0.008);
    figure.name = "outlined_on_lined_paper";
    figure
}

fn tadpole() -> Drawn {
    let mut canvas = Canvas::new(420, 520, 4.0);
    canvas.ellipse([210.0, 190.0], [110.0, 120.0]);
    for sign in [-1.0, 1.0] {
        canvas.stroke(&[
            [210.0 + sign * 45.0, 300.0],
            [210.0 + sign * 55.0, 390.0],
            [210.0 + sign * 60.0, 470.0],
            [210.0 + sign * 85.0, 472.0],
        ]);
        let arm = [[105.0, 210.0], [150.0, 230.0], [190.0, 220.0]];
        canvas.stroke(&arm.map(|[beside, row]| [210.0 + sign * beside, row]));
        canvas.ellipse([210.0 + sign * 40.0, 160.0], [8.0, 10.0]);
    }
    canvas.arc([210.0, 215.0], [50.0, 35.0], [0.05, 0.45]);
    let side = |sign: f64, name: [&'static str; 6]| {
        let at = |x: f64, y: f64| [210.0 + sign * x, y];
        let places =
            [at(105.0, 210.0), at(150.0, 230.0), at(190.0, 220.0), at(45.0, 300.0), at(55.0, 385.0), at(60.0, 465.0)];
        name.into_iter().zip(places)
    };
    let mut joints = vec![("root", [210.0, 295.0]), ("neck", [210.0, 180.0])];
    joints.extend(side(-1.0, ["right_shoulder", "right_elbow", "right_hand", "right_hip", "right_knee", "right_foot"]));
    joints.extend(side(1.0, ["left_shoulder", "left_elbow", "left_hand", "left_hip", "left_knee", "left_foot"]));
    Drawn { name: "tadpole", canvas, joints }
}

/// Boxes, with lines for limbs.
fn robot() -> Drawn {
    let mut canvas = Canvas::new(500, 600, 4.0);
    canvas.closed(&[[200.0, 60.0], [300.0, 60.0], [300.0, 150.0], [200.0, 150.0]]);
    canvas.stroke(&[[250.0, 150.0], [250.0, 180.0]]);
    canvas.closed(&[[170.0, 180.0], [330.0, 180.0], [330.0, 380.0], [170.0, 380.0]]);
    for sign in [-1.0, 1.0] {
        let at = |x: f64, y: f64| [250.0 + sign * x, y];
        canvas.stroke(&[at(80.0, 210.0), at(160.0, 260.0), at(170.0, 330.0)]);
        canvas.stroke(&[at(40.0, 380.0), at(40.0, 540.0), at(60.0, 545.0)]);
    }
    let side = |sign: f64, names: [&'static str; 5]| {
        let at = |x: f64, y: f64| [250.0 + sign * x, y];
        names.into_iter().zip([at(80.0, 210.0), at(160.0, 260.0), at(170.0, 325.0), at(40.0, 375.0), at(40.0, 530.0)])
    };
    let mut joints = vec![("neck", [250.0, 105.0])];
    joints.extend(side(-1.0, ["right_shoulder", "right_elbow", "right_hand", "right_hip", "right_foot"]));
    joints.extend(side(1.0, ["left_shoulder", "left_elbow", "left_hand", "left_hip", "left_foot"]));
    Drawn { name: "robot", canvas, joints }
}

fn filled() -> Drawn {
    let pose = ARMS_DOWN.at([260.0, 50.0], 600.0);
    let mut canvas = Canvas::new(520, 700, 3.0);
    solid(&mut canvas, &pose, [0.03, 0.04, 0.09], BODY);
    drawn("filled", pose, canvas)
}

fn cut_out() -> Drawn {
    let pose = ARMS_UP.at([260.0, 40.0], 600.0);
    let mut canvas = Canvas::new(520, 680, 3.0);
    solid(&mut canvas, &pose, [0.03, 0.04, 0.1], BODY);
    canvas.cut_out();
    drawn("cut_out", pose, canvas)
}

fn arms_on_the_body() -> Drawn {
    let mut pose = ARMS_DOWN.at([250.0, 50.0], 600.0);
    pose.limbs[..3].copy_from_slice(&[[-0.09, 0.34], [-0.11, 0.46], [-0.1, 0.57]]);
    outlined("arms_on_the_body", pose, [0.03, 0.045, 0.11], [500, 700], 3.0)
}

fn several_components() -> Drawn {
    let pose = ARMS_OUT.at([420.0, 120.0], 560.0);
    let mut figure = outlined("several_components", pose, [0.035, 0.045, 0.1], [900, 760], 3.5);
    let canvas = &mut figure.canvas;
    // A sun, a ball, and a hand that is drawn off the arm.
    canvas.ellipse([810.0, 90.0], [55.0, 55.0]);
    canvas.ellipse([90.0, 660.0], [40.0, 40.0]);
    let [x, y] = pose.place([0.415, 0.36]);
    canvas.ellipse([x + 12.0, y], [22.0, 24.0]);
    figure
}

fn noisy() -> Drawn {
    let pose = ARMS_OUT.at([300.0, 60.0], 560.0);
    let mut figure = outlined("noisy", pose, [0.04, 0.05, 0.11], [600, 690], 4.0);
    figure.canvas.weather(16.0, 0.35);
    figure
}

fn on_a_blackboard() -> Drawn {
    let pose = ARMS_OUT.at([300.0, 60.0], 560.0);
    let mut figure = outlined("on_a_blackboard", pose, [0.035, 0.05, 0.1], [600, 690], 4.0);
    figure.canvas.invert();
    figure
}

fn sheet_on_a_table() -> Drawn {
    let pose = ARMS_OUT.at([450.0, 190.0], 540.0);
    let mut figure = outlined("sheet_on_a_table", pose, [0.035, 0.05, 0.1], [900, 960], 3.5);
    let picture = &mut figure.canvas.picture;
    for row in 0..960 {
        for column in 0..900 {
            let (x, y) = (column as f64, row as f64);
            let is_sheet = x - 0.05 * y > 60.0 && x - 0.05 * y < 800.0 && y + 0.05 * x > 110.0 && y + 0.05 * x < 900.0;
            if !is_sheet {
                picture.pixels[row * 900 + column] = [126, 92, 64, 255];
            }
        }
    }
    figure
}

fn with_hair_and_skirt() -> Drawn {
    let pose = ARMS_OUT.at([300.0, 50.0], 600.0);
    let mut canvas = Canvas::new(600, 720, 3.5);
    solid(&mut canvas, &pose, [0.02, 0.022, 0.06], BODY);
    let [root, neck] = [pose.place([0.0, 0.58]), pose.place(pose.neck)];
    for step in 0..40 {
        let down = f64::from(step) / 40.0;
        let half = 36.0 + 70.0 * down;
        let y = root[1] - 30.0 + 120.0 * down;
        canvas.limb(&[[root[0] - half, y], [root[0] + half, y]], 3.0, BODY);
    }
    for sign in [-1.0, 1.0] {
        let x = neck[0] + sign * 58.0;
        canvas.limb(
            &[[x, neck[1] - 10.0], [x + sign * 30.0, neck[1] + 10.0], [x + sign * 34.0, neck[1] + 70.0]],
            9.0,
            BODY,
        );
    }
    canvas.outline(BODY);
    face(&mut canvas, &pose);
    drawn("with_hair_and_skirt", pose, canvas)
}

/// A small outline.
pub(crate) fn tiny() -> Drawn {
    outlined("tiny", ARMS_OUT.at([48.0, 6.0], 100.0), [0.035, 0.045, 0.1], [96, 112], 0.8)
}

/// Human figures.
pub(crate) fn humans() -> Vec<Drawn> {
    let thin = outlined("thin_limbs", ARMS_OUT.at([260.0, 40.0], 500.0), [0.012, 0.014, 0.1], [520, 600], 2.0);
    let thick = outlined("thick_limbs", ARMS_DOWN.at([300.0, 50.0], 600.0), [0.055, 0.07, 0.13], [600, 710], 5.0);
    let huge = outlined("huge", ARMS_UP.at([900.0, 120.0], 1560.0), [0.035, 0.045, 0.1], [1800, 1800], 9.0);
    vec![
        stick_figure(),
        stick_on_lined_paper(),
        outlined("outlined", ARMS_OUT.at([300.0, 50.0], 600.0), [0.035, 0.045, 0.1], [600, 710], 3.0),
        outlined_on_lined_paper(),
        with_gaps(),
        with_many_gaps(),
        tadpole(),
        robot(),
        filled(),
        cut_out(),
        thin,
        thick,
        tiny(),
        huge,
        several_components(),
        noisy(),
        on_a_blackboard(),
        sheet_on_a_table(),
        with_hair_and_skirt(),
    ]
}

/// A figure whose arms nobody can see.
pub(crate) fn armless() -> Drawn {
    arms_on_the_body()
}

/// A pig from the side, its head on the right.
pub(crate) fn pig() -> Drawn {
    let mut canvas = Canvas::new(620, 420, 3.5);
    canvas.blob([290.0, 200.0], [210.0, 110.0], BODY);
    canvas.blob([480.0, 150.0], [75.0, 70.0], BODY);
    canvas.blob([550.0, 165.0], [28.0, 24.0], BODY);
    let legs = [[140.0, 260.0], [190.0, 280.0], [370.0, 280.0], [430.0, 265.0]];
    for [x, y] in legs {
        canvas.limb(&[[x, y], [x, 370.0]], 18.0, BODY);
    }
    canvas.limb(&[[95.0, 150.0], [50.0, 130.0], [40.0, 160.0]], 6.0, BODY);
    canvas.limb(&[[455.0, 90.0], [465.0, 65.0]], 12.0, BODY);
    canvas.outline(BODY);
    let names = ["left_foot_b", "right_foot_b", "left_foot_f", "right_foot_f"];
    let mut joints = vec![("neck", [490.0, 150.0]), ("root", [280.0, 262.0])];
    joints.extend(names.into_iter().zip(legs.map(|[x, _]| [x, 365.0])));
    Drawn { name: "pig", canvas, joints }
}

/// A dog from the side, its head on the left, its neck up.
pub(crate) fn dog() -> Drawn {
    let mut canvas = Canvas::new(640, 520, 3.5);
    canvas.limb(&[[230.0, 250.0], [450.0, 250.0]], 58.0, BODY);
    canvas.limb(&[[210.0, 230.0], [160.0, 130.0]], 34.0, BODY);
    canvas.blob([140.0, 110.0], [62.0, 45.0], BODY);
    canvas.blob([85.0, 120.0], [35.0, 22.0], BODY);
    canvas.limb(&[[490.0, 215.0], [560.0, 150.0]], 10.0, BODY);
    let legs = [[200.0, 290.0], [250.0, 300.0], [430.0, 300.0], [480.0, 290.0]];
    for [x, y] in legs {
        canvas.limb(&[[x, y], [x - 4.0, 460.0]], 17.0, BODY);
    }
    canvas.outline(BODY);
    let names = ["left_foot_f", "right_foot_f", "left_foot_b", "right_foot_b"];
    let mut joints = vec![("neck", [135.0, 110.0])];
    joints.extend(names.into_iter().zip(legs.map(|[x, _]| [x, 455.0])));
    Drawn { name: "dog", canvas, joints }
}

/// A body with eight arms all around.
pub(crate) fn octopus() -> Drawn {
    let mut canvas = Canvas::new(600, 600, 3.5);
    canvas.blob([300.0, 300.0], [90.0, 90.0], BODY);
    for arm in 0..8 {
        let (sin, cos) = (f64::from(arm) / 8.0 * std::f64::consts::TAU + 0.2).sin_cos();
        canvas.limb(
            &[[300.0 + 80.0 * cos, 300.0 + 80.0 * sin], [300.0 + 250.0 * cos, 300.0 + 250.0 * sin]],
            14.0,
            BODY,
        );
    }
    Drawn { name: "octopus", canvas, joints: Vec::new() }
}

/// A plain sheet.
pub(crate) fn blank() -> Drawn {
    let mut canvas = Canvas::new(300, 300, 3.0);
    canvas.ink = PAPER;
    canvas.weather(3.0, 0.2);
    Drawn { name: "blank", canvas, joints: Vec::new() }
}
