// Shapes of what goes over the wire, as far as the page looks at them.

/** @typedef {{id: string, file_name: string, format: string, bytes: number, sha256: string}} Asset */
/** @typedef {Record<string, any>} Config the retarget spec, or the part of it that somebody has changed */
/** @typedef {{code: string, title: string, detail: string, hint?: string, status: number, errors?: {pointer: string, detail: string}[]}} ProblemBody */
/** @typedef {{confidence: number|null, alternatives: {joint: string, confidence: number}[], reasons: string[]}} RoleDetails */
/** @typedef {{role: string, source: string|string[]|null, target: string|string[]|null, confidence: number|null,
 *   source_details?: RoleDetails, target_details?: RoleDetails}} RolePair */
/** @typedef {{role: string, joint: string, aligned: string, turned_degrees: number, direction_degrees?: number, roll_degrees?: number}} Alignment */
/** @typedef {{code: string, place: string, detail: string, hint: string}} Warning */
/** @typedef {{resolved_spec: Config, rigs: Record<string, any>, roles: RolePair[], joints: {joint: string, driver: string|null, reason?: string}[],
 *   alignment: Alignment[], warnings: Warning[]}} Proposal */
/** @typedef {{frame: number, time_seconds: number, joint: string, part: string, value: number}} Worst */
/** @typedef {{unit: string, about: string, verdict: string, value?: number, warn_above: number, fail_above: number,
 *   worst?: Worst[], reason?: string}} Metric */
/** @typedef {{unit: string, times_seconds: number[], parts: Record<string, (number|null)[]>}} Curve */
/** @typedef {{verdict: string, verdict_reason: string, score: number, metrics: Record<string, Metric>, curves: Record<string, Curve>}} Measures */
/** @typedef {{timings: Record<string, number>, counts: Record<string, number>, warnings: Warning[], measures?: Measures,
 *   contacts?: {point: string, seconds: [number, number][]}[]}} Report */
/** @typedef {{id: string, state: string, results: {id: string, format: string, file_name: string}[], labels: Record<string, string>,
 *   verdict?: string, verdict_reason?: string, problem?: ProblemBody, batch_item?: number}} Job */

export {};
