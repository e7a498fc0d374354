//! A retarget compiled once, run on arrays.

use numpy::{IntoPyArray as _, PyArray2, PyArray3, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray3};
use pyo3::{exceptions::PyValueError, prelude::*};
use retargetd::engine::{Compiled, FrameArrays, FrameArraysMut, Inputs, Knowledge, Limits, PoseFrames};

use crate::{
    errors::raised,
    inputs::{Files, named},
    work::work,
};

/// A retarget of one pair of rigs with one config.
#[pyclass(frozen, module = "retargetd._engine")]
pub(crate) struct Plan {
    compiled: Compiled,
}

/// How poses of one side lie in arrays: names, parents, rest translations, rotations and scales, axes, meters per unit.
type Layout<'py> = (
    Vec<String>,
    Vec<i32>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<f32>>,
    String,
    f64,
);

/// Translations, rotations and scales at all frames.
type Arrays<'py> = (Bound<'py, PyArray3<f32>>, Bound<'py, PyArray3<f32>>, Bound<'py, PyArray3<f32>>);

#[pymethods]
impl Plan {
    #[new]
    fn new(py: Python<'_>, files: Files, rigs: Vec<String>) -> PyResult<Self> {
        let (Some(source), Some(target)) = (named(&files.0), named(&files.1)) else {
            return Err(PyValueError::new_err("a plan needs a source and a target"));
        };
        let inputs = Inputs {
            source,
            target,
            source_rest: named(&files.2),
            target_rest: named(&files.3),
            config: named(&files.4),
            formats: &[],
        };
        let knowledge = Knowledge::read(rigs.iter().map(String::as_str)).map_err(|failure| raised(py, &failure))?;
        let compiled = work(py, |control| Compiled::new(&inputs, &knowledge, &Limits::default(), control))?;
        Ok(Self { compiled })
    }

    /// How poses of the source lie.
    #[getter]
    fn source<'py>(&self, py: Python<'py>) -> PyResult<Layout<'py>> {
        layout(py, self.compiled.source())
    }

    /// How poses of the target lie.
    #[getter]
    fn target<'py>(&self, py: Python<'py>) -> PyResult<Layout<'py>> {
        layout(py, self.compiled.target())
    }

    /// What was found out, as JSON.
    #[getter]
    fn facts(&self) -> String {
        serde_json::to_string(self.compiled.facts()).unwrap_or_default()
    }

    /// Retargets. All arrays have as many frames as there are times, and the source's joints, frame after frame in one piece.
    fn run<'py>(
        &self,
        py: Python<'py>,
        times: PyReadonlyArray1<'py, f64>,
        translations: Option<PyReadonlyArray3<'py, f32>>,
        rotations: PyReadonlyArray3<'py, f32>,
        scales: Option<PyReadonlyArray3<'py, f32>>,
    ) -> PyResult<Arrays<'py>> {
        let times = times.as_slice()?.to_vec();
        let frames = times.len();
        let joints = self.compiled.source().joint_count();
        let whole = |array: &'_ PyReadonlyArray3<'py, f32>, width: usize| {
            let shape = array.as_array().shape().to_vec();
            if shape == [frames, joints, width] {
                return Ok(());
            }
            let wanted = format!("({frames}, {joints}, {width})");
            Err(PyValueError::new_err(format!("an array has the shape {shape:?} where {wanted} is needed")))
        };
        whole(&rotations, 4)?;
        translations.iter().chain(&scales).try_for_each(|array| whole(array, 3))?;
        let arrays = FrameArrays {
            translations: translations.as_ref().map(|array| array.as_slice()).transpose()?,
            rotations: rotations.as_slice()?,
            scales: scales.as_ref().map(|array| array.as_slice()).transpose()?,
        };
        let target = self.compiled.target();
        let values = frames * target.joint_count();
        let (translations, rotations, scales) = work(py, |control| {
            // In a thread of the pool: each parallel section that is begun elsewhere costs a message and a wait. Those threads stay, too,
            // and with them the memory that they had of earlier arrays.
            rayon::scope(|_| {
                let clip = self.compiled.run(times, &arrays, control)?;
                let mut made = (vec![0.0; values * 3], vec![0.0; values * 4], vec![0.0; values * 3]);
                let room = FrameArraysMut { translations: &mut made.0, rotations: &mut made.1, scales: &mut made.2 };
                target.fill(&clip, room);
                Ok(made)
            })
        })?;
        let shaped =
            |values: Vec<f32>, width: usize| values.into_pyarray(py).reshape([frames, target.joint_count(), width]);
        Ok((shaped(translations, 3)?, shaped(rotations, 4)?, shaped(scales, 3)?))
    }
}

fn layout<'py>(py: Python<'py>, frames: &PoseFrames) -> PyResult<Layout<'py>> {
    let parents = frames.parents().map(|parent| parent.and_then(|parent| i32::try_from(parent).ok()).unwrap_or(-1));
    let (mut translations, mut rotations, mut scales) = (Vec::new(), Vec::new(), Vec::new());
    for (translation, rotation, scale) in frames.rests() {
        translations.extend(translation.to_array());
        rotations.extend(rotation.to_array());
        scales.extend(scale.to_array());
    }
    let (axes, unit_meters) = frames.space();
    let shaped = |values: Vec<f32>, width: usize| values.into_pyarray(py).reshape([frames.joint_count(), width]);
    Ok((
        frames.names().map(str::to_owned).collect(),
        parents.collect(),
        shaped(translations, 3)?,
        shaped(rotations, 4)?,
        shaped(scales, 3)?,
        axes.to_string(),
        unit_meters,
    ))
}
