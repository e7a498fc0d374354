//! An explanation as a page for a terminal.

use std::fmt;

use crate::engine::{Contribution, Explanation, PelvisView};

impl fmt::Display for Explanation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { joint, frame, time_seconds, roles, driver, .. } = self;
        let roles = if roles.is_empty() { String::new() } else { format!(" ({})", roles.join(", ")) };
        let chain = self.chain.as_ref().map_or_else(String::new, |chain| format!(" '{chain}'"));
        writeln!(
            formatter,
            "'{joint}'{roles} at frame {frame} ({time_seconds:.3} s): {}{chain}",
            driver.replace('_', " ")
        )?;
        for source in &self.sources {
            let percent = source.share * 100.0;
            writeln!(
                formatter,
                "  follows {percent:.0} % '{}', turned by {:.2}° since rest",
                source.joint, source.turned_degrees
            )?;
        }
        writeln!(formatter)?;
        for Contribution { name, about, rotation: [x, y, z, w], degrees, moved_meters } in &self.contributions {
            write!(formatter, "  {name:<16}{degrees:>8.3}°  [{x:+.6} {y:+.6} {z:+.6} {w:+.6}]  {about}")?;
            match moved_meters {
                Some(meters) => writeln!(formatter, ", moves it by {:.2} cm", meters * 100.0)?,
                None => writeln!(formatter)?,
            }
        }
        let [x, y, z, w] = self.result.rotation;
        writeln!(formatter, "  {:<27}[{x:+.6} {y:+.6} {z:+.6} {w:+.6}]  in model space", "result")?;
        if let Some(position) = &self.position {
            write_position(formatter, position)?;
        }
        Ok(())
    }
}

fn write_position(formatter: &mut fmt::Formatter<'_>, position: &PelvisView) -> fmt::Result {
    let text = |[x, y, z]: [f64; 3]| format!("[{x:+.4} {y:+.4} {z:+.4}]");
    let PelvisView { source, source_origin, scale, target_origin, alpha, result } = position;
    writeln!(formatter, "\n  position, meters along right, up and front:")?;
    writeln!(
        formatter,
        "  {} = {} + {} * ({} - {}), alpha {alpha}",
        text(*result),
        text(*target_origin),
        text(*scale),
        text(*source),
        text(*source_origin)
    )
}
