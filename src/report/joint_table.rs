//! A joint table to start from: what a retarget of two files would do, as rows.

use serde_json::{Value, json};

use crate::{
    engine::{DriverView, Proposal},
    retarget::{TableRow, write_table},
};

/// A joint table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JointTable {
    rows: Vec<TableRow>,
}

impl JointTable {
    /// One row for each joint of the target that something drives: with the source joint that counts most, and the position of the
    /// pelvis.
    #[must_use]
    pub fn of(proposal: &Proposal) -> Self {
        let row = |view: &DriverView| {
            // Of equal shares the first is taken, which is the one nearer to the body.
            let most = view.sources.iter().rev().max_by(|first, second| first.weight.total_cmp(&second.weight))?;
            Some(TableRow {
                source: most.joint.clone(),
                target: view.joint.clone(),
                position: view.driver == Some("pelvis"),
            })
        };
        Self { rows: proposal.joints.iter().filter_map(row).collect() }
    }

    /// How many rows there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// As text for spreadsheets.
    #[must_use]
    pub fn to_csv(&self) -> String {
        write_table(&self.rows)
    }

    /// As a config with one `joints` op, on top of the target at rest.
    #[must_use]
    pub fn to_spec(&self) -> Value {
        let rows: Vec<Value> = self
            .rows
            .iter()
            .map(|row| json!({"source": row.source, "target": row.target, "position": row.position, "rotation": true}))
            .collect();
        json!({ "ops": [{ "op": "fk", "rotation": "none" }, { "op": "joints", "rows": rows }] })
    }
}
