//! What a span is known by in other processes: W3C Trace Context.

use std::fmt;

use opentelemetry::{
    Context,
    propagation::{Extractor, Injector, TextMapPropagator},
    trace::{SpanContext, TraceContextExt},
};
use opentelemetry_sdk::propagation::TraceContextPropagator;

const PARENT: &str = "traceparent";
const STATE: &str = "tracestate";

/// A span of this process or of another one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TraceContext(SpanContext);

tokio::task_local! {
    static CURRENT: Option<TraceContext>;
}

impl TraceContext {
    /// That of the headers of a request; `None` where they name no span, or break the rules.
    #[must_use]
    pub fn from_headers(traceparent: &str, tracestate: &str) -> Option<Self> {
        // The first version, the only one so far, has one length; the library takes shorter ones, too.
        if traceparent.starts_with("00-") && traceparent.len() != 55 || traceparent.is_empty() {
            return None;
        }
        let found = TraceContextPropagator::new().extract(&Headers([traceparent.to_owned(), tracestate.to_owned()]));
        Self::known(found.span().span_context().clone())
    }

    /// Reads what [`Self`] is written as; `None` where it is anything else.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let (parent, state) = text.split_once(' ').unwrap_or((text, ""));
        Self::from_headers(parent, state)
    }

    /// Does work on behalf of that span: whatever asks for [`Self::current`] in the same task is given it.
    pub async fn cover<F: Future>(context: Option<Self>, work: F) -> F::Output {
        CURRENT.scope(context, work).await
    }

    /// On whose behalf this task works.
    #[must_use]
    pub fn current() -> Option<Self> {
        CURRENT.try_with(Clone::clone).ok().flatten()
    }

    /// The 32 hexadecimal digits that all spans of the trace have.
    #[must_use]
    pub fn trace_id(&self) -> String {
        self.0.trace_id().to_string()
    }

    pub(super) fn known(span: SpanContext) -> Option<Self> {
        span.is_valid().then_some(Self(span))
    }

    /// As the library takes a parent.
    pub(super) fn parent(&self) -> Context {
        Context::new().with_remote_span_context(self.0.clone())
    }
}

/// The header `traceparent`, and behind a space `tracestate` where there is one.
impl fmt::Display for TraceContext {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut headers = Headers::default();
        TraceContextPropagator::new().inject_context(&self.parent(), &mut headers);
        let [parent, state] = headers.0;
        formatter.write_str(&parent)?;
        if state.is_empty() { Ok(()) } else { write!(formatter, " {state}") }
    }
}

/// The two headers.
#[derive(Default)]
struct Headers([String; 2]);

impl Extractor for Headers {
    fn get(&self, key: &str) -> Option<&str> {
        let place = [PARENT, STATE].into_iter().position(|name| name == key)?;
        Some(&self.0[place])
    }

    fn keys(&self) -> Vec<&str> {
        vec![PARENT, STATE]
    }
}

impl Injector for Headers {
    fn set(&mut self, key: &str, value: String) {
        if let Some(place) = [PARENT, STATE].into_iter().position(|name| name == key) {
            self.0[place] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

    #[test]
    fn what_is_read_is_written_the_same() {
        for (state, text) in [("", HEADER.to_owned()), ("a=1,b=2", format!("{HEADER} a=1,b=2"))] {
            let context = TraceContext::from_headers(HEADER, state).expect("a span");
            assert_eq!(context.to_string(), text, "both headers");
            assert_eq!(TraceContext::parse(&text).as_ref(), Some(&context), "read again");
            assert_eq!(context.trace_id(), "4bf92f3577b34da6a3ce929d0e0e4736", "of the trace");
        }
    }

    #[test]
    fn headers_that_break_the_rules_name_no_span() {
        let nothing = format!("00-{}-{}-01", "0".repeat(32), "0".repeat(16));
        for text in ["", "00", "sesame", &HEADER[..54], &HEADER.replace("00-4b", "ff-4b"), &nothing, "00-ä"] {
            assert_eq!(TraceContext::from_headers(text, "a=1"), None, "{text:?}");
        }
        assert_eq!(
            TraceContext::from_headers(HEADER, "no state").map(|span| span.to_string()),
            Some(HEADER.to_owned())
        );
    }

    #[tokio::test]
    async fn work_is_done_on_behalf_of_one_span_at_a_time() {
        assert_eq!(TraceContext::current(), None, "nobody's");
        let context = TraceContext::parse(HEADER);
        let seen = TraceContext::cover(context.clone(), async { TraceContext::current() }).await;
        assert_eq!((seen, TraceContext::current()), (context, None), "inside, and not beyond");
    }
}
