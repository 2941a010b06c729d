//! The files of the page, inside of the program.

macro_rules! files {
    ($($path:literal => $mime:literal, $name:literal;)*) => {
        /// Type and text of a file by its path.
        pub(crate) fn file(path: &str) -> Option<(&'static str, &'static str)> {
            match path {
                $($path => Some(($mime, include_str!(concat!("../page/", $name)))),)*
                _ => None,
            }
        }
    };
}

files! {
    "/" => "text/html; charset=utf-8", "index.html";
    "/style.css" => "text/css; charset=utf-8", "style.css";
    "/main.js" => "text/javascript; charset=utf-8", "main.js";
    "/connection.js" => "text/javascript; charset=utf-8", "connection.js";
    "/camera.js" => "text/javascript; charset=utf-8", "camera.js";
    "/controls.js" => "text/javascript; charset=utf-8", "controls.js";
    "/overlay.js" => "text/javascript; charset=utf-8", "overlay.js";
    "/pane.js" => "text/javascript; charset=utf-8", "pane.js";
    "/physics.js" => "text/javascript; charset=utf-8", "physics.js";
    "/timeline.js" => "text/javascript; charset=utf-8", "timeline.js";
    "/vectors.js" => "text/javascript; charset=utf-8", "vectors.js";
    "/film.js" => "text/javascript; charset=utf-8", "film.js";
    "/training.js" => "text/javascript; charset=utf-8", "training.js";
    "/favicon.svg" => "image/svg+xml", "favicon.svg";
}
