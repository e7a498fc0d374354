//! ONNX files, run by `rten`.

use std::panic::{AssertUnwindSafe, catch_unwind};

use rten::{Dimension, Model, Value};

use super::pose_answer::{Answer, PoseModelError, unusable};

/// A network that takes one picture.
pub(super) struct Network(Model);

impl std::fmt::Debug for Network {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Network")
    }
}

impl Network {
    /// A network, and how many pictures, colors, rows and columns it takes, where it says so.
    pub(super) fn read(bytes: Vec<u8>) -> Result<(Self, [Option<usize>; 4]), PoseModelError> {
        const FIX: &str = "give an ONNX file that holds its weights";
        let read = guarded(|| Model::load(bytes))?;
        let model = read.map_err(|error| unusable(format!("it is no ONNX file that can be used: {error}"), FIX))?;
        let inputs = model.input_ids().len();
        let shape = model.input_shape(0).filter(|_| inputs == 1);
        let sides: Option<[Option<usize>; 4]> = shape.and_then(|shape| {
            let side = |dimension: &Dimension| match dimension {
                Dimension::Fixed(side) => Some(*side),
                Dimension::Symbolic(_) => None,
            };
            shape.iter().map(side).collect::<Vec<_>>().try_into().ok()
        });
        let sides = sides.ok_or_else(|| {
            unusable(
                "it does not take one picture and nothing else",
                "export it with one input of 1 x 3 x height x width",
            )
        })?;
        Ok((Self(model), sides))
    }

    /// Everything that it answers to numbers of a shape.
    pub(super) fn ask(&self, shape: [usize; 4], numbers: Vec<f32>) -> Result<Vec<Answer>, PoseModelError> {
        let failed = |error: &dyn std::fmt::Display| {
            unusable(format!("it cannot be run: {error}"), "try it with another program, and export it again")
        };
        let input = Value::from_shape(shape, numbers).map_err(|error| failed(&error))?;
        let (inputs, outputs) = (vec![(self.0.input_ids()[0], input.into())], self.0.output_ids());
        let values = guarded(|| self.0.run(inputs, outputs, None))?.map_err(|error| failed(&error))?;
        let answer = |value: Value| {
            let of_four = value.clone().into_shape_vec::<f32, 4>().map(|(shape, numbers)| (shape.to_vec(), numbers));
            let of_three = || value.into_shape_vec::<f32, 3>().map(|(shape, numbers)| (shape.to_vec(), numbers));
            of_four.or_else(|_| of_three()).unwrap_or_default()
        };
        Ok(values.into_iter().map(answer).collect())
    }
}

/// Does what may panic over a file that nobody has checked.
fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, PoseModelError> {
    catch_unwind(AssertUnwindSafe(work))
        .map_err(|_| unusable("it breaks what runs it", "try it with another program, and export it again"))
}
