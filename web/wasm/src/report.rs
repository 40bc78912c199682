//! Reports of the core as JSON: see `commands.ts` and `protocol.ts`.

use isoswarm_scene::{Change, DragReport, FitReport, Hit, TransferReport};
use serde_json::{Value, json};

pub fn change(c: &Change) -> Value {
    json!({
        "model": c.model,
        "parameters": c.parameters,
        "pin": c.pin,
        "lost": c.lost,
        "drag": c.drag.as_ref().map(drag),
        "fit": c.fit.as_ref().map(fit),
        "transfer": c.transfer.as_ref().map(transfer),
    })
}

pub fn drag(r: &DragReport) -> Value {
    let slip: Vec<Value> = r.slip.iter().map(|(pin, by)| json!({ "pin": pin, "by": by })).collect();
    json!({
        "reached": r.reached,
        "ending": r.ending.name(),
        "distance": r.distance,
        "rank": r.rank,
        "pins": r.pins,
        "residual": r.residual,
        "slip": slip,
        "steps": r.steps,
        "at_limit": r.at_limit,
    })
}

pub fn fit(r: &FitReport) -> Value {
    json!({
        "converged": r.converged,
        "reason": r.reason,
        "rms": r.rms,
        "largest": r.largest,
        "skipped": r.skipped,
        "rank": r.rank,
        "freedom": r.freedom,
        "iterations": r.iterations,
        "at_limit": r.at_limit,
    })
}

pub fn transfer(r: &TransferReport) -> Value {
    json!({
        "rms": r.rms,
        "largest": r.largest,
        "relative": r.relative,
        "rank": r.rank,
        "freedom": r.freedom,
        "at_limit": r.at_limit,
    })
}

pub fn hit(h: Hit) -> Value {
    json!({ "at": h.at, "normal": h.normal, "t": h.t })
}
