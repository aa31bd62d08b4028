# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators whose work takes long: it is shown how far it is, and Esc cancels it. In the background, they wait."""
import bpy

from .jobs import Cancelled

TICK_SECONDS = 0.1
PROGRESS_STEPS = 1000

running = []  # the jobs of all operators that have not ended


class JobOperator:
    """A mixin. finish(context, result) is called in Blender's thread when the work has ended. It returns whether it has
    changed anything."""

    _job = None
    _timer = None

    def finish(self, context, result):
        raise NotImplementedError

    def run(self, context, job):
        """What execute() returns."""
        self._job = job
        if bpy.app.background or context.window is None:
            job.run()
            return self._end(context)
        job.start()
        running.append(job)
        manager = context.window_manager
        self._timer = manager.event_timer_add(TICK_SECONDS, window=context.window)
        manager.progress_begin(0, PROGRESS_STEPS)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            self.cancel(context)
            self.report({"WARNING"}, "Cancelled")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self._job.is_done:
            self._close(context)
            return self._end(context)
        self._show(context)
        return {"PASS_THROUGH"}

    def cancel(self, context):
        """Blender calls this, too, if it opens another file."""
        self._job.cancel()
        self._close(context)

    def _show(self, context):
        context.window_manager.progress_update(round(PROGRESS_STEPS * self._job.fraction))
        text = f"ESVR: {self._job.text}, {self._job.fraction:.0%}. Esc cancels."
        context.workspace.status_text_set(text)

    def _close(self, context):
        running.remove(self._job)
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)

    def _end(self, context):
        error = self._job.error
        if error is None:
            try:
                return {"FINISHED"} if self.finish(context, self._job.result) else {"CANCELLED"}
            except RuntimeError as refused:  # an operator of Blender, for example outside the object mode
                error = refused
        if not isinstance(error, Cancelled):
            self.report({"ERROR"}, str(error))
        return {"CANCELLED"}


def register():
    pass


def unregister():
    """Ends all jobs before the add-on goes away."""
    for job in running:
        job.cancel()
    for job in running:
        job.wait()
