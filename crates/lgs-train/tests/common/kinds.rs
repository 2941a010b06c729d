//! Settings of tiny trainings of each kind of source.

use lgs_model::source::SourceKind;

/// Nodes are chosen three times, with stops between them, and cameras refined, with stops before and after;
/// brightness is learned before the last densification, with the two kinds that together have all stages, and
/// given up between two stops with the third, after an iteration that lights a single moment.
pub(crate) fn own_settings(kind: SourceKind) -> &'static [&'static str] {
    let of_nodes = &[
        "source.nodes.initial=12",
        "source.nodes.most=16",
        "source.nodes.interval=25",
        "source.cameras.refine_exposure=on",
        "source.cameras.refine_poses=on",
        "source.cameras.pose_after=0.4",
        "source.shading.times=3",
        "source.shading.after=15",
        "source.shading.trial=0",
    ];
    match kind {
        SourceKind::Defgs => {
            &["source.shading.times=16", "source.shading.after=40", "source.shading.trial=1"]
        }
        SourceKind::Nodes => of_nodes,
        _ => &of_nodes[6..],
    }
}
